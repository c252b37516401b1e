#pragma once

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <type_traits>
#include <vector>

#include "recorder/sinks/growing_file.hpp"

namespace sls::record {

/// A CSV file that grows row by row. Reading a number gives the same double that was written.
/// `flush()` writes whole rows only.
/// Every member @throws std::system_error with the name of the file if it cannot be written.
class CsvFile {
 public:
  /// Creates `file`, which must not exist, and writes `header` as its first line.
  CsvFile(const std::filesystem::path& file, std::string_view header,
          WriteCall write = system_write());

  void add(double value);
  void add(std::string_view text);  ///< quoted if it has a comma, a quote or a line break
  template <class Integer, std::enable_if_t<std::is_integral_v<Integer>, int> = 0>
  void add(Integer value) {
    char* const begin = begin_field(kLongestInteger);
    used_ +=
        static_cast<std::size_t>(std::to_chars(begin, begin + kLongestInteger, value).ptr - begin);
  }
  /// Each element of an array or vector is a field.
  template <class Vector>
  void add_all(const Vector& values) {
    for (int i = 0; i < static_cast<int>(values.size()); ++i) add(values[i]);
  }
  void end_row();

  /// Passes every finished row to the operating system.
  void flush();

  std::uint64_t rows() const { return rows_; }
  /// Bytes that a flush would write.
  std::size_t pending_bytes() const { return finished_; }
  const std::filesystem::path& path() const { return file_.path(); }

 private:
  /// Makes room for a field of `bytes` bytes and its separator, and writes the separator.
  char* begin_field(std::size_t bytes) {
    if (buffer_.size() < used_ + bytes + 2)  // 2: a comma before it, a line break after it
      buffer_.resize(std::max(2 * buffer_.size(), used_ + bytes + 2));
    if (row_begun_) buffer_[used_++] = ',';
    row_begun_ = true;
    return buffer_.data() + used_;
  }
  std::size_t count_whole_rows(std::size_t bytes) const;
  void forget(std::size_t bytes);

  static constexpr std::size_t kLongestInteger = 20;  // characters, of a negative one of 64 bits

  GrowingFile file_;
  std::vector<char> buffer_;
  std::size_t used_ = 0;      // bytes of the buffer that are in use
  std::size_t finished_ = 0;  // of those, bytes of whole rows
  bool row_begun_ = false;
  std::uint64_t rows_ = 0;
};

}  // namespace sls::record
