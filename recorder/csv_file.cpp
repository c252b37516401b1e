#include "recorder/csv_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <system_error>

namespace sls::record {
namespace {

constexpr std::size_t kFlushBytes = 1 << 18;  // bounds the memory between two timed flushes

[[noreturn]] void throw_errno(const std::filesystem::path& file, const char* what) {
  throw std::system_error(errno, std::generic_category(), file.string() + ": " + what);
}

}  // namespace

CsvFile::CsvFile(const std::filesystem::path& file, std::string_view header) : path_(file) {
  descriptor_ = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0644);
  if (descriptor_ < 0) throw_errno(path_, "cannot create");
  buffer_.append(header).push_back('\n');
  finished_ = buffer_.size();
}

CsvFile::~CsvFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void CsvFile::add(double value) {
  std::array<char, 32> digits;  // the longest shortest form of a double has 24 characters
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  add_field({digits.data(), static_cast<std::size_t>(end - digits.data())});
}

void CsvFile::add(std::string_view text) {
  if (text.find_first_of(",\"\n\r") == std::string_view::npos) return add_field(text);
  std::string quoted = "\"";
  for (const char letter : text) {
    if (letter == '"') quoted += '"';
    quoted += letter;
  }
  add_field(quoted += '"');
}

void CsvFile::add_field(std::string_view text) {
  if (row_begun_) buffer_.push_back(',');
  row_begun_ = true;
  buffer_.append(text);
}

void CsvFile::end_row() {
  buffer_.push_back('\n');
  row_begun_ = false;
  finished_ = buffer_.size();
  ++rows_;
  if (buffer_.size() >= kFlushBytes) flush();
}

void CsvFile::flush() {
  std::size_t written = 0;
  while (written < finished_) {
    const ssize_t count = ::write(descriptor_, buffer_.data() + written, finished_ - written);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int error = errno;
      cut_back_to_whole_rows(written);
      errno = error;
      throw_errno(path_, "cannot write");
    }
    written += static_cast<std::size_t>(count);
  }
  forget(finished_);
}

/// A row the disk took only in part would look like data.
void CsvFile::cut_back_to_whole_rows(std::size_t written) {
  std::size_t whole = 0;
  bool is_quoted = false;
  for (std::size_t i = 0; i < written; ++i) {
    if (buffer_[i] == '"') is_quoted = !is_quoted;
    if (buffer_[i] == '\n' && !is_quoted) whole = i + 1;
  }
  const off_t end = ::lseek(descriptor_, 0, SEEK_END);
  const auto surplus = static_cast<off_t>(written - whole);
  if (end >= surplus && ::ftruncate(descriptor_, end - surplus) != 0) {
    // The caller reports the error that led here.
  }
  forget(whole);
}

void CsvFile::forget(std::size_t bytes) {
  buffer_.erase(0, bytes);
  finished_ -= bytes;
}

}  // namespace sls::record
