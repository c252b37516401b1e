#include "common/config/scenario_reader.hpp"

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/config/numbers.hpp"
#include "common/text/edit_distance.hpp"

namespace sls::config {
namespace {

std::string join(const std::vector<std::string>& words) {
  std::string joined;
  for (const std::string& word : words) joined += (joined.empty() ? "" : ", ") + word;
  return joined;
}

std::string join_path(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

double read_number(const Value& value) {
  const bool plain = value.node.kind == YamlNode::Kind::kScalar && !value.node.quoted;
  const auto number = plain ? parse_number(value.node.text) : std::nullopt;
  if (!number) value.fail_expecting("a number");
  if (!std::isfinite(*number)) value.fail_expecting("a finite number");
  return *number;
}

/// The whole number in `node` if it is one within `range`.
template <class Number, class Bounds>
std::optional<Number> find_whole_number(const YamlNode& node, const Bounds& range) {
  Number number = 0;
  const std::string& text = node.text;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool whole = node.kind == YamlNode::Kind::kScalar && !node.quoted && error == std::errc() &&
                     end == text.data() + text.size();
  return whole && number >= range.least && number <= range.most ? std::optional(number)
                                                                : std::nullopt;
}

template <class Bounds>
std::string to_whole_number(const Bounds& range) {
  return "a whole number from " + std::to_string(range.least) + " to " + std::to_string(range.most);
}

std::string to_list(const ListRange& range) {
  return "a list of " + std::to_string(range.least) + " to " + std::to_string(range.most) + " " +
         range.elements;
}

template <class Number, class Bounds>
void read_whole_number(const Value& value, Number& number, const Bounds& range) {
  const auto whole = find_whole_number<Number>(value.node, range);
  if (!whole) value.fail_expecting(to_whole_number(range));
  number = *whole;
}

template <class Vector>
void read_numbers(const Value& value, Vector& vector, const char* expectation,
                  const NumberRule& of_each) {
  if (value.node.kind != YamlNode::Kind::kList ||
      value.node.items.size() != static_cast<std::size_t>(vector.size()))
    value.fail_expecting(expectation);
  for (int i = 0; i < vector.size(); ++i)
    read_value(value.at(static_cast<std::size_t>(i)), vector[i], of_each);
}

std::string to_json_text(const std::string& text) { return nlohmann::json(text).dump(); }

/// Any value as JSON. Plain numbers, true, false and empty values keep their type; other scalars
/// become strings.
std::string to_json(const Value& value) {
  const YamlNode& node = value.node;
  std::string text;
  switch (node.kind) {
    case YamlNode::Kind::kNothing:
      return "null";
    case YamlNode::Kind::kScalar:
      if (!node.quoted && (node.text == "true" || node.text == "false")) return node.text;
      if (!node.quoted && parse_number(node.text)) return to_text(read_number(value));
      return to_json_text(node.text);
    case YamlNode::Kind::kList:
      for (std::size_t i = 0; i < node.items.size(); ++i)
        text += (i > 0 ? ", " : "") + to_json(value.at(i));
      return "[" + text + "]";
    case YamlNode::Kind::kMap:
      for (std::size_t i = 0; i < node.items.size(); ++i) {
        const YamlNode& key = node.keys[i];
        const Value child = value.at(key.text, node.items[i], key.line);
        const auto is_same = [&](const YamlNode& other) { return other.text == key.text; };
        if (key.kind != YamlNode::Kind::kScalar) child.fail("expected a key, got " + to_brief(key));
        if (std::count_if(node.keys.begin(), node.keys.end(), is_same) > 1)
          child.fail("duplicate key");
        text += (i > 0 ? ", " : "") + to_json_text(key.text) + ": " + to_json(child);
      }
      return "{" + text + "}";
  }
  return "null";
}

}  // namespace

std::string Places::describe(int line) const {
  return line > 0 ? file_ + ":" + std::to_string(line) : file_;
}

ConfigError Places::make_error_at(const std::string& path, const std::string& message) const {
  std::string place = path;
  while (lines_.count(place) == 0 && !place.empty()) {
    const auto end = place.find_last_of(".[");
    place.resize(end == place.npos ? 0 : end);
  }
  const auto found = lines_.find(place);
  return make_error(file_, found == lines_.end() ? 0 : found->second, path, message);
}

Value Value::at(const std::string& key, const YamlNode& child, int key_line) const {
  // yaml-cpp gives a map, a list or an empty value the line of the next token, which may be lines
  // below.
  const int child_line = child.kind == YamlNode::Kind::kScalar ? child.line : key_line;
  const std::string child_path = join_path(path, key);
  places.add(child_path, child_line);
  return {child, child_path, child_line, places};
}

Value Value::at(std::size_t index) const {
  const YamlNode& child = node.items[index];
  const int child_line = child.kind == YamlNode::Kind::kNothing ? line : child.line;
  const std::string child_path = path + "[" + std::to_string(index) + "]";
  places.add(child_path, child_line);
  return {child, child_path, child_line, places};
}

std::optional<std::string> KeyNames::find_owner(const std::string& name) const {
  const auto found = owners_.find(name);
  return found == owners_.end() ? std::nullopt : std::optional(found->second);
}

void check_keys(const Value& value, const KeyNames& names) {
  const std::vector<std::string>& known = names.names();
  if (value.node.kind != YamlNode::Kind::kMap) value.fail_expecting("a map");
  std::map<std::string, int> seen;
  for (const YamlNode& key : value.node.keys) {
    if (key.kind != YamlNode::Kind::kScalar)
      throw value.places.make_error_at(key.line, value.path,
                                       "expected a key, got " + to_brief(key));
    const auto fail = [&](const std::string& message) {
      throw value.places.make_error_at(key.line, join_path(value.path, to_printable(key.text)),
                                       message);
    };
    const auto [first, is_new] = seen.emplace(key.text, key.line);
    if (!is_new) fail("duplicate key; it is already on line " + std::to_string(first->second));
    if (std::find(known.begin(), known.end(), key.text) != known.end()) continue;
    if (const auto owner = names.find_owner(key.text)) fail(*owner);
    if (const auto similar = text::find_similar(key.text, known))
      fail("unknown key; did you mean '" + *similar + "'?");
    fail("unknown key; expected one of " + join(known));
  }
}

int find_key(const YamlNode& map, const std::string& name) {
  const auto& keys = map.keys;
  const auto found =
      std::find_if(keys.begin(), keys.end(), [&](const YamlNode& key) { return key.text == name; });
  return found == keys.end() ? -1 : static_cast<int>(found - keys.begin());
}

void read_value(const Value& value, double& number, const NumberRule& rule) {
  number = read_number(value);
  if (!rule.holds(number)) value.fail_expecting(rule.expectation);
}

void read_value(const Value& value, std::int64_t& nanoseconds, const NumberRule& rule) {
  double seconds = 0.0;
  read_value(value, seconds, rule);
  if (seconds > kMaxSeconds) value.fail_expecting("at most 1000000 s");
  const auto whole = to_nanoseconds(seconds);
  // A tiny positive number rounds to zero nanoseconds.
  if (!whole || !rule.holds(static_cast<double>(*whole)))
    value.fail_expecting("a whole number of nanoseconds");
  nanoseconds = *whole;
}

void read_value(const Value& value, int& number, const Range& range) {
  read_whole_number(value, number, range);
}

void read_value(const Value& value, std::uint64_t& number, const WideRange& range) {
  read_whole_number(value, number, range);
}

void read_value(const Value& value, bool& flag) {
  const bool plain = value.node.kind == YamlNode::Kind::kScalar && !value.node.quoted;
  if (!plain || (value.node.text != "true" && value.node.text != "false"))
    value.fail_expecting("true or false");
  flag = value.node.text == "true";
}

void read_value(const Value& value, std::string& text, const TextRule& rule) {
  if (value.node.kind != YamlNode::Kind::kScalar) value.fail_expecting("text");
  if (!rule.holds(value.node.text)) value.fail_expecting(rule.expectation);
  text = value.node.text;
}

void read_value(const Value& value, Eigen::Vector3d& vector) { read_value(value, vector, kFinite); }

void read_value(const Value& value, Eigen::Vector3d& vector, const NumberRule& of_each) {
  read_numbers(value, vector, "a list of three numbers", of_each);
}

void read_value(const Value& value, Eigen::Vector2d& vector, const NumberRule& of_each) {
  read_numbers(value, vector, "a list of two numbers", of_each);
}

void read_value(const Value& value, Eigen::Quaterniond& quaternion) {
  constexpr double kUnitLength = 1e-6;  // tolerance for rounded numbers
  constexpr double kRounding = 1e-15;   // written quaternions must read back to the same bits
  if (value.node.kind != YamlNode::Kind::kList || value.node.items.size() != 4)
    value.fail_expecting("a unit quaternion, a list w, x, y, z");
  double wxyz[4];
  for (std::size_t i = 0; i < 4; ++i) read_value(value.at(i), wxyz[i], kFinite);
  quaternion = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  const double length = quaternion.norm();
  if (!(std::abs(length - 1.0) <= kUnitLength))
    value.fail("expected a unit quaternion, got one of length " + to_text(length));
  if (std::abs(length - 1.0) > kRounding) quaternion.normalize();
}

void read_value(const Value& value, std::vector<VehicleVariant>& fleet, const ListRange& range) {
  if (value.node.kind == YamlNode::Kind::kList) {
    fleet.assign(read_list_length(value, range), VehicleVariant{});
    for (std::size_t i = 0; i < fleet.size(); ++i) read_value(value.at(i), fleet[i]);
    return;
  }
  const auto count = find_whole_number<int>(value.node, range);
  if (!count) value.fail_expecting(to_whole_number(range) + " or " + to_list(range));
  fleet = make_vehicle_grid(static_cast<std::size_t>(*count));
}

void read_value(const Value& value, ModelName& model, const std::vector<std::string>& known,
                const std::string& expectation) {
  const std::string& name = value.node.text;
  const bool is_text = value.node.kind == YamlNode::Kind::kScalar;
  const ModelName named{name, value.places.describe(value.line)};
  const bool is_known = std::find(known.begin(), known.end(), name) != known.end();
  if (!is_text || !(is_known || named.is_shared_library())) {
    const auto similar = is_text ? text::find_similar(name, known) : std::nullopt;
    value.fail("expected " + expectation + ", got " + to_brief(value.node) +
               (similar ? "; did you mean '" + *similar + "'?" : ""));
  }
  model = named;
}

void read_value(const Value& value, LibraryParameters& parameters) {
  if (value.node.kind != YamlNode::Kind::kMap) value.fail_expecting("a map");
  parameters = {to_json(value), value.places.describe(value.line)};
}

void read_value(const Value& value, std::vector<RecordFormat>& formats) {
  if (value.node.kind != YamlNode::Kind::kList) value.fail_expecting("a list of csv and mcap");
  Record record;
  record.formats.clear();
  for (std::size_t i = 0; i < value.node.items.size(); ++i) {
    const Value item = value.at(i);
    RecordFormat format{};
    read_value(item, format);
    if (record.has(format))
      item.fail("expected each format once, got " + item.node.text + " again");
    record.formats.push_back(format);
  }
  if (!record.has(RecordFormat::kCsv))
    value.fail_expecting("csv among the formats, which verify, resume and report read");
  formats = record.formats;
}

std::size_t read_list_length(const Value& value, const ListRange& range) {
  const std::size_t length = value.node.items.size();
  if (value.node.kind != YamlNode::Kind::kList || length < static_cast<std::size_t>(range.least) ||
      length > static_cast<std::size_t>(range.most))
    value.fail_expecting(to_list(range));
  return length;
}

}  // namespace sls::config
