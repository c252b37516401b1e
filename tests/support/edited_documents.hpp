/// Documents made of a base and edits, one row of a table each, with the error message of each.
///
/// "# TEXT" is a comment. "== NAME" begins a base: its lines up to an empty line; then come its
/// rows. A row has one or more edits and ends with "! MESSAGE", behind its last edit or on a line
/// of its own. Edits:
/// - "vehicle.load_mass_kg: -0.16" sets a YAML key or item that has lines of its own, or adds the
///   key. Indented lines that follow belong to the value.
/// - "- plant.rotors[1].axis" removes a key.
/// - "s/OLD/NEW/" replaces OLD, which is there once (empty: inserts NEW before the document).
///   '/' may be '|'. \n, \t, \\ and \xHH are characters.
#pragma once

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace sls::test {

struct EditedDocument {
  std::string place;  ///< FILE:LINE of the message in the table
  std::string text;
  std::string message;
};

/// Lines of a document in which edits change some.
class EditedLines {
 public:
  void add(const std::string& line) { lines_.push_back(line); }

  std::string text() const {
    std::string text;
    for (const std::string& line : lines_) text += line + '\n';
    return text;
  }

  /// `edit` is a line of a row with the indented lines that follow.
  void apply(const std::string& edit) {
    if (edit.rfind("s/", 0) == 0 || edit.rfind("s|", 0) == 0) return replace(edit);
    if (edit.rfind("- ", 0) == 0) return remove(edit.substr(2));
    const auto colon = edit.find(':');
    if (colon == edit.npos) throw std::runtime_error("expected an edit, got " + edit);
    set(edit.substr(0, colon), edit.substr(colon));
  }

 private:
  /// The lines of a value; none if only its parent is there.
  struct Place {
    std::size_t begin, end, column;
    std::string key;  ///< empty for an item of a list
  };

  static std::size_t indent_of(const std::string& line) {
    return std::min(line.find_first_not_of(' '), line.size());
  }

  std::size_t find_end(std::size_t begin, std::size_t end, std::size_t column) const {
    while (++begin < end && indent_of(lines_[begin]) > column) {
    }
    return begin;
  }

  Place find(const std::string& path) const {
    Place place{0, lines_.size(), 0, ""};
    for (std::size_t at = 0; at < path.size();) {
      if (!place.key.empty()) {  // its children
        if (++place.begin >= place.end) throw std::runtime_error(path + ": no lines for it");
        place.column = indent_of(lines_[place.begin]);
      }
      const bool is_item = path[at] == '[';
      const auto end = std::min(path.find_first_of(is_item ? "]" : ".[", at + 1), path.size());
      const std::string step = path.substr(at + is_item, end - at - is_item);
      at = end + (is_item ? 1 : 0);
      if (at < path.size() && path[at] == '.') ++at;
      const std::string wanted = is_item ? "- " : step + ":";
      auto left = is_item ? std::stoul(step) : 0;
      const std::size_t bottom = place.end;
      place.key = is_item ? "" : step;
      while (place.begin < bottom &&
             (lines_[place.begin].find_first_not_of(" -") < place.column ||
              lines_[place.begin].compare(place.column, wanted.size(), wanted) != 0 || left-- > 0))
        ++place.begin;
      if (place.begin == bottom && (at < path.size() || is_item))
        throw std::runtime_error(path + ": no such place");
      if (place.begin < bottom) place.end = find_end(place.begin, bottom, place.column);
      if (is_item && at < path.size()) place.column += 2;
    }
    return place;
  }

  void set(const std::string& path, const std::string& value) {
    const Place place = find(path);
    std::string head(place.column, ' ');
    if (place.begin < place.end) head = lines_[place.begin].substr(0, place.column);
    lines_.erase(lines_.begin() + place.begin, lines_.begin() + place.end);
    lines_.insert(lines_.begin() + place.begin,
                  head + (place.key.empty() ? "-" + value.substr(1) : place.key + value));
  }

  void remove(const std::string& path) {
    const Place place = find(path);
    if (place.begin == place.end) throw std::runtime_error(path + ": no such place");
    lines_.erase(lines_.begin() + place.begin, lines_.begin() + place.end);
  }

  void replace(const std::string& edit) {
    const auto middle = edit.find(edit[1], 2), end = edit.find(edit[1], middle + 1);
    if (end == edit.npos) throw std::runtime_error("expected s/OLD/NEW/, got " + edit);
    const std::string from = unescape(edit.substr(2, middle - 2));
    std::string text = this->text();
    if (!from.empty() && (text.find(from) == text.npos || text.find(from) != text.rfind(from)))
      throw std::runtime_error(edit + ": not there once");
    text.replace(text.find(from), from.size(), unescape(edit.substr(middle + 1, end - middle - 1)));
    lines_.clear();
    for (std::size_t at = 0; at < text.size(); at = text.find('\n', at) + 1)
      add(text.substr(at, text.find('\n', at) - at));
  }

  static std::string unescape(std::string text) {
    for (std::size_t at = 0; (at = text.find('\\', at)) != text.npos; ++at) {
      const char letter = text.at(at + 1);
      if (letter == 'x')
        text.replace(at, 4, 1, static_cast<char>(std::stoi(text.substr(at + 2, 2), nullptr, 16)));
      else
        text.replace(at, 2, 1, letter == 'n' ? '\n' : letter == 't' ? '\t' : letter);
    }
    return text;
  }

  std::vector<std::string> lines_;
};

/// The documents of a table. @throws std::runtime_error with the line of a row that is none.
inline std::vector<EditedDocument> read_edited_documents(const std::string& table) {
  std::ifstream stream(table);
  if (!stream) throw std::runtime_error("cannot read " + table);
  std::vector<EditedDocument> documents;
  EditedLines base;
  std::vector<std::string> edits;
  bool in_base = false;
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    const std::string place = table + ":" + std::to_string(++number);
    if (line.rfind("== ", 0) == 0) {
      base = {};
      in_base = true;
    } else if (line.empty()) {
      in_base = false;
    } else if (in_base) {
      base.add(line);
    } else if (line[0] == ' ' && !edits.empty()) {
      edits.back() += '\n' + line;
    } else if (line[0] != '#') {
      const auto mark = line.rfind("! ", 0) == 0 ? 0 : line.find(" ! ");
      if (mark != 0) edits.push_back(line.substr(0, mark));
      if (mark == line.npos) continue;
      EditedLines lines = base;
      try {
        for (const std::string& edit : edits) lines.apply(edit);
      } catch (const std::exception& error) {
        throw std::runtime_error(place + ": " + error.what());
      }
      documents.push_back({place, lines.text(), line.substr(line.find("! ", mark) + 2)});
      edits.clear();
    }
  }
  return documents;
}

}  // namespace sls::test
