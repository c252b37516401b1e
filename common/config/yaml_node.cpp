#include "common/config/yaml_node.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <utility>

#include "common/text/printable.hpp"

namespace sls::config {
namespace {

constexpr std::size_t kMaxDepth = 16;  // A scenario needs 5.

int to_line(const YAML::Mark& mark) { return mark.line + 1; }

/// Collects the parser's events into a tree.
class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(const std::string& place) : place_(place) {}

  const std::optional<YamlNode>& root() const { return root_; }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (root_) fail(mark, "expected one YAML document, got a second one");
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    add(make_node(YamlNode::Kind::kNothing, mark, "", anchor));
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    fail(mark, "expected a value, got a YAML alias (write the value out)");
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    YamlNode node = make_node(YamlNode::Kind::kScalar, mark, tag, anchor);
    node.quoted = tag == "!";  // yaml-cpp's mark of a scalar that is not plain
    node.text = value;
    add(std::move(node));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(make_node(YamlNode::Kind::kList, mark, tag, anchor));
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(make_node(YamlNode::Kind::kMap, mark, tag, anchor));
  }
  void OnMapEnd() override { close(); }

 private:
  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& message) const {
    throw make_error(place_, to_line(mark), "", message);
  }

  YamlNode make_node(YamlNode::Kind kind, const YAML::Mark& mark, const std::string& tag,
                     YAML::anchor_t anchor) const {
    if (anchor != 0) fail(mark, "expected a value, got a YAML anchor (write the value out)");
    if (!tag.empty() && tag != "?" && tag != "!")
      fail(mark, "expected a plain value, got the YAML tag " + to_printable(tag));
    YamlNode node;
    node.kind = kind;
    node.line = to_line(mark);
    return node;
  }

  void open(YamlNode node) {
    if (open_.size() == kMaxDepth)
      throw make_error(
          place_, node.line, "",
          "expected at most " + std::to_string(kMaxDepth) + " levels of nesting, got more");
    open_.push_back(std::move(node));
  }

  void close() {
    YamlNode node = std::move(open_.back());
    open_.pop_back();
    add(std::move(node));
  }

  void add(YamlNode node) {
    if (open_.empty()) {
      root_ = std::move(node);
      return;
    }
    YamlNode& parent = open_.back();
    const bool is_key =
        parent.kind == YamlNode::Kind::kMap && parent.keys.size() == parent.items.size();
    (is_key ? parent.keys : parent.items).push_back(std::move(node));
  }

  const std::string& place_;
  std::vector<YamlNode> open_;  // from the root down to the innermost list or map
  std::optional<YamlNode> root_;
};

bool is_control(unsigned char c) {
  return (c < 0x20 && c != '\t' && c != '\n' && c != '\r') || c == 0x7F;
}

std::string to_hex(unsigned char byte) {
  static constexpr char kDigits[] = "0123456789abcdef";
  return {kDigits[byte >> 4], kDigits[byte & 15]};
}

void check_is_text(const std::string& text, const std::string& place) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = text::calc_utf8_length(text, at);
    const auto byte = static_cast<unsigned char>(text[at]);
    if (length == 0 || is_control(byte)) {
      const auto position = text.begin() + static_cast<std::ptrdiff_t>(at);
      const auto line = 1 + std::count(text.begin(), position, '\n');
      throw make_error(place, static_cast<int>(line), "",
                       "expected UTF-8 text, got the byte 0x" + to_hex(byte));
    }
    at += length;
  }
}

/// The message of the library without the anchor's name, which yaml-cpp 0.8 adds.
std::string to_message(const YAML::Exception& error) {
  const std::string undefined = "the referenced anchor is not defined";
  const bool is_undefined = error.msg.compare(0, undefined.size(), undefined) == 0;
  return is_undefined ? undefined : to_printable(error.msg, 100);
}

/// The expectation and the text of the line of the error: yaml-cpp names neither.
std::string describe_syntax_error(const std::string& text, int line, const YAML::Exception& error) {
  std::istringstream lines(text);
  std::string before, here;
  for (int number = 1; number <= line && std::getline(lines, here); ++number)
    if (number + 1 == line) before = here;
  const auto has_tab = [](const std::string& indented) {
    return indented.substr(0, indented.find_first_not_of(" \t")).find('\t') != std::string::npos;
  };
  if (has_tab(here) || has_tab(before)) return "spaces before a key, got a tab";
  const std::string message = to_message(error);
  if (message == "illegal map value")
    return "KEY: VALUE, as deep as the keys around it, got '" + to_printable(here, 60) +
           "' after '" + to_printable(before, 60) + "'";
  return "YAML, got a syntax error: " + message;
}

}  // namespace

YamlNode parse_yaml(const std::string& text, const std::string& place) {
  check_is_text(text, place);
  TreeBuilder builder(place);
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(builder)) {
    }
  } catch (const YAML::Exception& error) {
    const int line = error.mark.is_null() ? 0 : to_line(error.mark);
    throw make_error(place, line, "", "expected " + describe_syntax_error(text, line, error));
  }
  YamlNode nothing;
  nothing.line = 1;
  return builder.root().value_or(nothing);
}

bool is_utf8(const std::string& text) {
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t length = text::calc_utf8_length(text, at);
    if (length == 0) return false;
    at += length;
  }
  return true;
}

std::string to_printable(const std::string& text, std::size_t most) {
  std::string printable;
  for (const char c : text) {
    if (printable.size() >= most) return printable + "...";
    if (c >= ' ' && c <= '~')
      printable += c;
    else
      printable += "\\x" + to_hex(static_cast<unsigned char>(c));
  }
  return printable;
}

std::string to_brief(const YamlNode& node) {
  switch (node.kind) {
    case YamlNode::Kind::kNothing:
      return "nothing";
    case YamlNode::Kind::kScalar:
      return node.quoted ? '"' + to_printable(node.text) + '"' : to_printable(node.text);
    case YamlNode::Kind::kList:
      return "a list of " + std::to_string(node.items.size());
    case YamlNode::Kind::kMap:
      return "a map";
  }
  return "";
}

ConfigError make_error(const std::string& place, int line, const std::string& path,
                       const std::string& message) {
  std::string text = place;
  if (line > 0) text += ":" + std::to_string(line);
  if (!path.empty()) text += ": " + path;
  return ConfigError(text + ": " + message);
}

}  // namespace sls::config
