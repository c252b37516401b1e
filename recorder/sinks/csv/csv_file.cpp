#include "recorder/sinks/csv/csv_file.hpp"

#include <array>
#include <cstring>
#include <utility>

#include "recorder/sinks/csv/shortest_number.hpp"

namespace sls::record {
namespace {

constexpr std::size_t kFlushBytes = 1 << 18;  // bounds the memory between two timed flushes

/// A number as text: the shortest that reads back to the same double.
struct NumberText {
  std::uint64_t bits = 0;  // of the double
  std::size_t length = 0;
  std::array<char, kLongestNumber> letters{};
};

/// The latest texts, because flight.csv repeats the numbers of the other files.
class NumberTexts {
 public:
  const NumberText& find(double number) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    NumberText& text = texts_[bits * 0x9e37'79b9'7f4a'7c15 >> (64 - kIndexBits)];
    if (text.bits != bits || text.length == 0) {
      std::array<char, kNumberRoom> letters;
      const char* const end = write_shortest(number, letters.data());
      text.length = static_cast<std::size_t>(end - letters.data());
      std::memcpy(text.letters.data(), letters.data(), sizeof text.letters);
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

CsvFile::CsvFile(const std::filesystem::path& file, std::string_view header, WriteCall write)
    : file_(file, std::move(write)) {
  std::copy(header.begin(), header.end(), begin_field(header.size()));
  used_ += header.size();
  end_row();
  rows_ = 0;
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
  file_.append({buffer_.data(), finished_}, [this](std::size_t written) {
    const std::size_t kept = count_whole_rows(written);
    forget(kept);
    return kept;
  });
  forget(finished_);
}

/// Bytes of the whole rows among the first `bytes` of the buffer.
std::size_t CsvFile::count_whole_rows(std::size_t bytes) const {
  std::size_t whole = 0;
  bool is_quoted = false;
  for (std::size_t i = 0; i < bytes; ++i) {
    if (buffer_[i] == '"') is_quoted = !is_quoted;
    if (buffer_[i] == '\n' && !is_quoted) whole = i + 1;
  }
  return whole;
}

void CsvFile::forget(std::size_t bytes) {
  std::copy(buffer_.data() + bytes, buffer_.data() + used_, buffer_.data());
  used_ -= bytes;
  finished_ -= bytes;
}

}  // namespace sls::record
