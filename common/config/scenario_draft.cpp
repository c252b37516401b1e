#include "common/config/scenario_draft.hpp"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "common/config/scenario_reader.hpp"

namespace sls::config {
namespace {

/// The keys and indices of a path.
std::vector<std::string> split(const std::string& path) {
  std::vector<std::string> parts(1);
  for (const char letter : path) {
    if (letter == '.')
      parts.emplace_back();
    else
      parts.back() += letter;
  }
  return parts;
}

/// `part` as an index of a list of `size` items.
std::optional<std::size_t> find_index(const std::string& part, std::size_t size) {
  const bool is_number =
      !part.empty() && part.size() < 6 && part.find_first_not_of("0123456789") == std::string::npos;
  if (!is_number) return std::nullopt;
  const std::size_t index = std::stoul(part);
  return index < size ? std::optional(index) : std::nullopt;
}

YamlNode make_key(const std::string& name, int line) {
  YamlNode key;
  key.kind = YamlNode::Kind::kScalar;
  key.line = line;
  key.text = name;
  return key;
}

/// Gives every node of a replacing value the line of the replaced one.
void place_at(YamlNode& node, int line) {
  node.line = line;
  for (YamlNode& key : node.keys) place_at(key, line);
  for (YamlNode& item : node.items) place_at(item, line);
}

// --- YAML text ---------------------------------------------------------------------------------

/// A text in double quotes. Source: YAML 1.2.2, section 5.7.
std::string to_quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '\n')
      quoted += "\\n";
    else if (c == '\r')
      quoted += "\\r";
    else if (c == '\t')
      quoted += "\\t";
    else if (c == '"' || c == '\\')
      (quoted += '\\') += c;
    else
      quoted += c;
  }
  return quoted + '"';
}

/// In quotes if the file has it in quotes, because a quoted number is a text, or if it has several
/// lines.
std::string to_scalar(const YamlNode& node) {
  return node.quoted || node.text.find('\n') != std::string::npos ? to_quoted(node.text)
                                                                  : node.text;
}

bool is_leaf(const YamlNode& node) {
  return node.kind == YamlNode::Kind::kScalar || node.kind == YamlNode::Kind::kNothing ||
         node.items.empty();
}

std::string to_leaf(const YamlNode& node) {
  switch (node.kind) {
    case YamlNode::Kind::kScalar:
      return to_scalar(node);
    case YamlNode::Kind::kList:
      return "[]";
    case YamlNode::Kind::kMap:
      return "{}";
    case YamlNode::Kind::kNothing:
      return "~";
  }
  return "";
}

/// In quotes if readers of YAML 1.1 take it for true.
std::string to_key(const YamlNode& node) {
  return node.text == "on" ? to_quoted(node.text) : to_leaf(node);
}

/// A list of numbers, in one line.
bool is_row(const YamlNode& node) {
  return node.kind == YamlNode::Kind::kList &&
         std::all_of(node.items.begin(), node.items.end(), [](const YamlNode& item) {
           return item.kind == YamlNode::Kind::kScalar &&
                  item.text.find_first_of("0123456789") != std::string::npos &&
                  item.text.find_first_not_of("+-.0123456789eE") == std::string::npos;
         });
}

void write(const YamlNode& node, std::size_t depth, std::string& text);

/// The text after a key or a dash.
void write_value(const YamlNode& node, std::size_t depth, std::string& text) {
  if (is_leaf(node)) {
    text += " " + to_leaf(node) + "\n";
  } else if (is_row(node)) {
    for (std::size_t i = 0; i < node.items.size(); ++i)
      text += (i == 0 ? " [" : ", ") + to_scalar(node.items[i]);
    text += "]\n";
  } else {
    text += "\n";
    write(node, depth, text);
  }
}

void write(const YamlNode& node, std::size_t depth, std::string& text) {
  const std::string indent(2 * depth, ' ');
  if (is_leaf(node)) text += indent + to_leaf(node) + "\n";
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    text += indent + (node.kind == YamlNode::Kind::kMap ? to_key(node.keys[i]) + ":" : "-");
    write_value(node.items[i], depth + 1, text);
  }
}

}  // namespace

ScenarioDraft::ScenarioDraft(const std::filesystem::path& file)
    : ScenarioDraft(read_config_file(file, "a scenario file"), file.string(), file.parent_path()) {}

ScenarioDraft::ScenarioDraft(const std::string& text, std::string place,
                             std::filesystem::path folder)
    : place_(std::move(place)), folder_(std::move(folder)), root_(parse_yaml(text, place_)) {}

void ScenarioDraft::set(const std::string& path, const std::string& value) {
  YamlNode* node = &root_;
  std::string here;
  for (const std::string& part : split(path)) {
    const auto fail = [&](const std::string& message) {
      return make_error(place_, node->line, here, message + " on the way to " + path);
    };
    if (part.empty()) throw make_error(place_, 0, path, "expected keys separated by dots");
    if (node->kind == YamlNode::Kind::kList) {
      const auto index = find_index(part, node->items.size());
      if (!index)
        throw fail("expected one of the list's items, 0 to " +
                   std::to_string(static_cast<long>(node->items.size()) - 1) + ", got " +
                   to_printable(part));
      node = &node->items[*index];
    } else if (node->kind == YamlNode::Kind::kScalar) {
      throw fail("expected a map or a list, got " + to_brief(*node));
    } else {
      node->kind = YamlNode::Kind::kMap;  // an empty value becomes a map
      int index = find_key(*node, part);
      if (index < 0) {
        node->keys.push_back(make_key(part, node->line));
        node->items.emplace_back().line = node->line;
        index = static_cast<int>(node->items.size()) - 1;
      }
      node = &node->items[static_cast<std::size_t>(index)];
    }
    here += (here.empty() ? "" : ".") + part;
  }
  const int line = node->line;
  *node = parse_yaml(value, path);
  place_at(*node, line);
}

Scenario ScenarioDraft::make_scenario(const Models& models) const {
  Scenario scenario = read_scenario(root_, place_, to_text(), models);
  scenario.folder = folder_;
  return scenario;
}

std::string ScenarioDraft::to_text() const {
  std::string text;
  write(root_, 0, text);
  return text;
}

}  // namespace sls::config
