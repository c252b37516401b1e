#include "recorder/sinks/csv/csv_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "recorder/sinks/file_error.hpp"

namespace sls::record {
namespace {

constexpr std::size_t kFlushBytes = 1 << 18;  // bounds the memory between two timed flushes

/// A number as text: the shortest that reads back to the same double.
struct NumberText {
  std::uint64_t bits = 0;  // of the double
  std::size_t length = 0;
  std::array<char, 24> letters{};  // as many as -2.2250738585072014e-308 has
};

/// The latest texts, because flight.csv repeats the numbers of the other files.
class NumberTexts {
 public:
  const NumberText& find(double number) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    NumberText& text = texts_[bits * 0x9e37'79b9'7f4a'7c15 >> (64 - kIndexBits)];
    if (text.bits != bits || text.length == 0) {
      char* const begin = text.letters.data();
      char* const end = std::to_chars(begin, begin + text.letters.size(), number).ptr;
      text.length = static_cast<std::size_t>(end - begin);
      text.bits = bits;
    }
    return text;
  }

 private:
  static constexpr int kIndexBits = 8;  // a step has some 40 different numbers
  std::array<NumberText, 1 << kIndexBits> texts_;
};

bool is_special(char letter) {
  return letter == ',' || letter == '"' || letter == '\n' || letter == '\r';
}

}  // namespace

CsvFile::CsvFile(const std::filesystem::path& file, std::string_view header) : path_(file) {
  descriptor_ = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0644);
  if (descriptor_ < 0) throw_errno(path_, "cannot create");
  std::copy(header.begin(), header.end(), begin_field(header.size()));
  used_ += header.size();
  end_row();
  rows_ = 0;
}

CsvFile::~CsvFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void CsvFile::add(double value) {
  thread_local NumberTexts texts;  // of all files that this thread writes
  const NumberText& text = texts.find(value);
  // A copy of constant size needs no call.
  std::memcpy(begin_field(sizeof text.letters), text.letters.data(), sizeof text.letters);
  used_ += text.length;
}

void CsvFile::add(std::string_view text) {
  const bool is_quoted = std::any_of(text.begin(), text.end(), is_special);
  char* const begin = begin_field(is_quoted ? 2 * text.size() + 2 : text.size());
  char* end = begin;
  if (is_quoted) *end++ = '"';
  for (const char letter : text) {
    if (letter == '"') *end++ = '"';
    *end++ = letter;
  }
  if (is_quoted) *end++ = '"';
  used_ += static_cast<std::size_t>(end - begin);
}

void CsvFile::end_row() {
  if (!row_begun_) begin_field(0);
  buffer_[used_++] = '\n';
  row_begun_ = false;
  finished_ = used_;
  ++rows_;
  if (used_ >= kFlushBytes) flush();
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

/// Removes a row that was written only in part, because it would look like data.
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
    // The caller reports the earlier error.
  }
  forget(whole);
}

void CsvFile::forget(std::size_t bytes) {
  std::copy(buffer_.data() + bytes, buffer_.data() + used_, buffer_.data());
  used_ -= bytes;
  finished_ -= bytes;
}

}  // namespace sls::record
