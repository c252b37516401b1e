#include "recorder/sinks/csv/csv_reader.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "common/text/regular_file.hpp"

namespace sls::record {
namespace {

constexpr std::size_t kBlock = 1 << 18;
constexpr std::size_t kLongestRecord = 1 << 20;  // in a valid file: some hundred bytes

}  // namespace

CsvReader::CsvReader(const std::filesystem::path& file, std::string_view header, Further further)
    : path_(file.string()) {
  try {
    stream_ = text::open_regular_file(file);
  } catch (const text::NoRegularFile& error) {
    throw DamagedError(path_ + ": cannot read: expected a file, got " + error.what());
  }
  const std::string expected(header);
  const bool is_there = find_record();
  const std::string line = is_there ? buffer_.substr(begin_, end_ - begin_) : "";
  if (!is_there ||
      (line != expected &&
       (further == Further::kNone || line.compare(0, expected.size() + 1, expected + ",") != 0)))
    throw DamagedError(path_ + ":1: expected the columns " + expected);
  for (std::size_t from = 0; from <= line.size();) {
    const std::size_t comma = std::min(line.find(',', from), line.size());
    columns_.push_back(line.substr(from, comma - from));
    from = comma + 1;
  }
}

std::string CsvReader::place() const { return path_ + ":" + std::to_string(line_) + ": "; }

bool CsvReader::next() {
  if (!find_record()) return false;
  split_record();
  if (fields_.size() != columns_.size())
    throw DamagedError(place() + "expected " + std::to_string(columns_.size()) + " fields, got " +
                       std::to_string(fields_.size()));
  return true;
}

/// Finds the next line break outside quotes.
bool CsvReader::find_record() {
  if (is_at_end_) return false;
  begin_ = line_ == 0 ? 0 : end_ + 1;
  line_ = next_line_;
  bool is_quoted = false;
  for (std::size_t at = begin_;; ++at) {
    if (at - begin_ > kLongestRecord) throw DamagedError(place() + "expected a row, got no end");
    while (at >= buffer_.size()) {
      const std::size_t length = at - begin_;
      if (!read_more()) return !(is_at_end_ = true);
      at = begin_ + length;
    }
    const char letter = buffer_[at];
    if (letter == '"') is_quoted = !is_quoted;
    if (letter != '\n') continue;
    ++next_line_;
    if (is_quoted) continue;
    end_ = at;
    return true;
  }
}

/// Reads the next block and keeps the part of the current record that was read before.
bool CsvReader::read_more() {
  buffer_.erase(0, begin_);
  begin_ = 0;
  const std::size_t size = buffer_.size();
  buffer_.resize(size + kBlock);
  stream_.read(buffer_.data() + size, kBlock);
  if (stream_.bad()) throw DamagedError(path_ + ": cannot read: " + std::strerror(errno));
  buffer_.resize(size + static_cast<std::size_t>(stream_.gcount()));
  return buffer_.size() > size;
}

void CsvReader::split_record() {
  fields_.clear();
  unquoted_.clear();
  const std::string_view record = std::string_view(buffer_).substr(begin_, end_ - begin_);
  std::size_t at = 0;
  while (true) {
    if (at < record.size() && record[at] == '"') {
      std::string& text = unquoted_.emplace_back();
      for (++at; at < record.size(); ++at) {
        if (record[at] == '"' && (++at >= record.size() || record[at] != '"')) break;
        text += record[at];
      }
      fields_.push_back(text);
    } else {
      const std::size_t comma = std::min(record.find(',', at), record.size());
      fields_.push_back(record.substr(at, comma - at));
      at = comma;
    }
    if (at >= record.size()) return;
    if (record[at] != ',') throw DamagedError(place() + "expected a comma after a quoted field");
    ++at;
    if (at == record.size()) return fields_.push_back({});
  }
}

}  // namespace sls::record
