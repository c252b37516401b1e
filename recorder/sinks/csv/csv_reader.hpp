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

/// A recording's file is not what it should be; the message names file, line and cause.
class DamagedError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads a CSV file row by row (RFC 4180: quoted fields may hold line breaks). A last row without a
/// line break was cut when its writer was killed: it is no row.
class CsvReader {
 public:
  enum class Further { kNone, kAllowed };  ///< columns after those that are known

  /// Opens `file`, whose first line must be `header`, or may go on after it.
  /// Every member @throws DamagedError.
  CsvReader(const std::filesystem::path& file, std::string_view header,
            Further further = Further::kNone);

  /// Reads the next row into `fields()`; false at the end.
  bool next();

  /// Of the last row read; valid until the next one.
  const std::vector<std::string_view>& fields() const { return fields_; }

  /// A row has that many.
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
  std::list<std::string> unquoted_;  // fields whose text is not in the buffer as it is
};

}  // namespace sls::record
