#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <list>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace sls::record {

/// A file of a recording is damaged. The message names file, line and cause.
class DamagedError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Opens a regular file of a recording. @throws DamagedError
std::ifstream open_recorded_file(const std::filesystem::path& file);

/// Reads a CSV file row by row (RFC 4180: quoted fields may hold line breaks). A last row without a
/// line break is ignored: it was cut when its writer was killed.
class CsvReader {
 public:
  enum class Further { kNone, kAllowed };  ///< columns after the known ones

  /// Opens `file`. Its first line must be `header`; with `kAllowed`, more columns may follow.
  /// Every member @throws DamagedError.
  CsvReader(const std::filesystem::path& file, std::string_view header,
            Further further = Further::kNone);

  /// Reads the next row into `fields()`; false at the end.
  bool next();

  /// The fields of the last row read; valid until the next call of `next`.
  const std::vector<std::string_view>& fields() const { return fields_; }

  /// The names of the columns; each row has as many fields.
  const std::vector<std::string>& columns() const { return columns_; }

  /// "FILE:LINE: " of the last row read.
  std::string place() const;

 private:
  bool find_record();
  bool read_more();
  void split_record();

  const std::string path_;
  std::ifstream stream_;
  std::string buffer_;
  std::size_t begin_ = 0, end_ = 0;  // of the record in the buffer, without its line break
  std::uint64_t line_ = 0, next_line_ = 1;
  bool is_at_end_ = false;
  std::vector<std::string> columns_;
  std::vector<std::string_view> fields_;
  std::list<std::string> unquoted_;  // texts of the quoted fields
};

}  // namespace sls::record
