#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace sls::record::test {

/// A CSV file as another program reads it (RFC 4180).
struct CsvTable {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
  bool is_whole = true;  ///< ends with a line break outside quotes, or is empty

  std::size_t find_column(const std::string& name) const {
    for (std::size_t i = 0; i < header.size(); ++i)
      if (header[i] == name) return i;
    throw std::runtime_error("no column " + name);
  }
  const std::string& text(std::size_t row, const std::string& column) const {
    return rows.at(row).at(find_column(column));
  }
  double number(std::size_t row, const std::string& column) const {
    return std::stod(text(row, column));
  }
};

inline CsvTable parse_csv(const std::string& bytes) {
  std::vector<std::vector<std::string>> lines;
  std::vector<std::string> line;
  std::string field;
  bool quoted = false;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const char letter = bytes[i];
    if (quoted) {
      if (letter != '"')
        field += letter;
      else if (i + 1 < bytes.size() && bytes[i + 1] == '"')
        field += bytes[++i];
      else
        quoted = false;
    } else if (letter == '"') {
      quoted = true;
    } else if (letter == ',') {
      line.push_back(std::move(field));
      field.clear();
    } else if (letter == '\n') {
      line.push_back(std::move(field));
      field.clear();
      lines.push_back(std::move(line));
      line.clear();
    } else {
      field += letter;
    }
  }
  CsvTable table;
  table.is_whole = !quoted && line.empty() && field.empty();
  if (!lines.empty()) {
    table.header = lines.front();
    table.rows.assign(lines.begin() + 1, lines.end());
  }
  return table;
}

}  // namespace sls::record::test
