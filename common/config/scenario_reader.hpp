/// Reads the keys that scenario_keys.hpp describes from a YAML tree, strictly.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "common/config/scenario_keys.hpp"
#include "common/config/yaml_node.hpp"

namespace sls::config {

/// The line of each key that was read, for error messages of rules between keys; and the models
/// that the file may name.
class Places {
 public:
  Places(std::string file, const Models& models) : file_(std::move(file)), models_(models) {}
  void add(const std::string& path, int line) { lines_[path] = line; }
  bool has(const std::string& path) const { return lines_.count(path) != 0; }
  const Models& models() const { return models_; }

  /// FILE:LINE.
  std::string describe(int line) const;

  /// Error at `path` or, if the file does not have it, at the innermost map or list around it.
  ConfigError make_error_at(const std::string& path, const std::string& message) const;
  ConfigError make_error_at(int line, const std::string& path, const std::string& message) const {
    return make_error(file_, line, path, message);
  }

 private:
  std::string file_;
  const Models& models_;
  std::map<std::string, int> lines_;
};

/// A node, the path that leads to it and the line that a message about it names.
struct Value {
  const YamlNode& node;
  std::string path;
  int line;
  Places& places;

  [[noreturn]] void fail(const std::string& message) const {
    throw places.make_error_at(line, path, message);
  }
  [[noreturn]] void fail_expecting(const std::string& expectation) const {
    fail("expected " + expectation + ", got " + to_brief(node));
  }
  Value at(const std::string& key, const YamlNode& child, int key_line) const;
  Value at(std::size_t index) const;
};

/// A `Map` that only collects the names of the keys.
class KeyNames {
 public:
  explicit KeyNames(const Value& map) : map_(map) {}

  template <class Field, class... Rule>
  void key(Presence, const char* name, Field&, const Rule&...) {
    add(name);
  }
  template <class Choice>
  void choose(Choice&, std::initializer_list<Alternative<Choice>> alternatives) {
    for (const auto& alternative : alternatives)
      for (const char* name : alternative.keys) add(name);
  }
  /// Collects the keys that belong to the value in the file; without a value, those of all values.
  template <class Enum, class DescribeOthers>
  void decide(const char* name, Enum& field, const DescribeOthers& describe_others);
  /// Collects the keys of the model in the file, and notes which other models have which keys.
  template <class Section>
  void model(const char* name, ModelName& field, ModelRegistry<Section> Models::*list,
             Section& section);
  template <class Field>
  void by_default(Field&, const Field&) {}

  const std::vector<std::string>& names() const { return names_; }
  /// The error message if only other models have the key `name`; else nothing.
  std::optional<std::string> find_owner(const std::string& name) const;

 private:
  void add(const std::string& name) {
    if (std::find(names_.begin(), names_.end(), name) == names_.end()) names_.push_back(name);
  }

  const Value& map_;
  std::vector<std::string> names_;
  std::map<std::string, std::string> owners_;  // of keys that belong to other models
};

/// Index of `name` among the keys of `map`, or −1.
int find_key(const YamlNode& map, const std::string& name);

/// @throws ConfigError unless `value` is a map with no other keys than `known`, each at most once.
void check_keys(const Value& value, const KeyNames& known);

// One per type of field. @throws ConfigError if the node is something else or breaks the rule.
void read_value(const Value& value, double& number, const NumberRule& rule);
void read_value(const Value& value, std::int64_t& nanoseconds, const NumberRule& rule);
void read_value(const Value& value, int& number, const Range& range);
void read_value(const Value& value, std::uint64_t& number, const WideRange& range);
void read_value(const Value& value, bool& flag);
void read_value(const Value& value, std::string& text, const TextRule& rule);
void read_value(const Value& value, Eigen::Vector3d& vector);
void read_value(const Value& value, Eigen::Vector3d& vector, const NumberRule& of_each);
void read_value(const Value& value, Eigen::Vector2d& vector, const NumberRule& of_each);
/// A list w, x, y, z of length 1, which is then normalised.
void read_value(const Value& value, Eigen::Quaterniond& quaternion);
void read_value(const Value& value, std::vector<VehicleVariant>& fleet, const ListRange& range);
/// A list of formats, each at most once, csv among them.
void read_value(const Value& value, std::vector<RecordFormat>& formats);
/// `names` are those of a registry; `expectation` lists them for the error message.
void read_value(const Value& value, ModelName& model, const std::vector<std::string>& names,
                const std::string& expectation);
void read_value(const Value& value, LibraryParameters& parameters);
std::size_t read_list_length(const Value& value, const ListRange& range);

template <class Enum>
std::string join_names() {
  std::string joined;
  for (const auto& name : names_of(Enum{}))
    joined += (joined.empty() ? "" : " or ") + std::string(name.text);
  return joined;
}

template <class Section>
std::vector<std::string> list_names(const ModelRegistry<Section>& registry) {
  std::vector<std::string> names;
  for (const auto& item : registry) names.push_back(item.first);
  return names;
}

/// Completes "missing key; expected …".
template <class Field>
std::string to_expectation(const Field&) {
  if constexpr (std::is_enum_v<Field>) return join_names<Field>();
  if constexpr (std::is_same_v<Field, bool>) return "true or false";
  if constexpr (std::is_arithmetic_v<Field>) return "a number";
  if constexpr (std::is_same_v<Field, std::string>) return "text";
  if constexpr (std::is_same_v<Field, Eigen::Vector3d>) return "a list of three numbers";
  if constexpr (std::is_same_v<Field, std::vector<Stage>>) return "a list of stages";
  return "a map";
}
template <class Field>
std::string to_expectation(const std::optional<Field>&) {
  return to_expectation(Field{});
}

/// The `Map` that reads: describe(reader, field) fills `field` from the file.
class MapReader {
 public:
  explicit MapReader(const Value& map) : map_(map) {}

  template <class Field, class... Rule>
  void key(Presence presence, const char* name, Field& field, const Rule&... rule);

  template <class Choice>
  void choose(Choice& choice, std::initializer_list<Alternative<Choice>> alternatives);

  template <class Enum, class DescribeOthers>
  void decide(const char* name, Enum& field, const DescribeOthers& describe_others) {
    key(kRequired, name, field);
    describe_others(field);
  }

  template <class Section>
  void model(const char* name, ModelName& field, ModelRegistry<Section> Models::*list,
             Section& section) {
    const ModelRegistry<Section>& registry = map_.places.models().*list;
    key(kOptional, name, field, list_names(registry), list_models(registry));
    find_model_keys(registry, field).describe(*this, section);
  }

  template <class Field>
  void by_default(Field& field, const Field& value) {
    field = value;
  }

 private:
  const Value& map_;
};

template <class Element>
void read_value(const Value& value, std::vector<Element>& list, const ListRange& range) {
  list.assign(read_list_length(value, range), Element{});
  for (std::size_t i = 0; i < list.size(); ++i) read_value(value.at(i), list[i]);
}

/// Optional parts of the file.
template <class Field, class... Rule>
void read_value(const Value& value, std::optional<Field>& field, const Rule&... rule) {
  read_value(value, field.emplace(), rule...);
}

/// Maps, and texts that stand for the value of an enumeration.
template <class Field, class... Rule>
void read_value(const Value& value, Field& field, const Rule&... rule) {
  if constexpr (std::is_enum_v<Field>) {
    for (const auto& name : names_of(field)) {
      if (value.node.kind != YamlNode::Kind::kScalar || value.node.text != name.text) continue;
      field = name.value;
      return;
    }
    value.fail_expecting(join_names<Field>());
  } else {
    KeyNames keys(value);
    describe(keys, field, rule...);
    check_keys(value, keys);
    MapReader reader(value);
    describe(reader, field, rule...);
  }
}

template <class Field, class... Rule>
void MapReader::key(Presence presence, const char* name, Field& field, const Rule&... rule) {
  const int index = find_key(map_.node, name);
  if (index >= 0) {
    const auto i = static_cast<std::size_t>(index);
    const Value value = map_.at(name, map_.node.items[i], map_.node.keys[i].line);
    read_value(value, field, rule...);
  } else if (presence == kRequired) {
    const std::string path = map_.path.empty() ? name : map_.path + "." + name;
    throw map_.places.make_error_at(map_.line, path,
                                    "missing key; expected " + to_expectation(field));
  }
}

template <class Choice>
void MapReader::choose(Choice& choice, std::initializer_list<Alternative<Choice>> alternatives) {
  std::string all, present;
  int chosen = 0;
  for (const auto& alternative : alternatives) {
    std::string together, here;
    for (const char* name : alternative.keys) {
      together += (together.empty() ? "" : "+") + std::string(name);
      if (here.empty() && find_key(map_.node, name) >= 0) here = name;
    }
    all += (all.empty() ? "" : ", ") + together;
    if (here.empty()) continue;
    present += (present.empty() ? "" : " and ") + here;
    choice = alternative.value;
    ++chosen;
  }
  if (chosen != 1)
    map_.fail("expected exactly one of " + all + ", got " + (present.empty() ? "none" : present));
}

template <class Enum, class DescribeOthers>
void KeyNames::decide(const char* name, Enum& field, const DescribeOthers& describe_others) {
  add(name);
  if (find_key(map_.node, name) >= 0) {
    MapReader(map_).key(kRequired, name, field);
    describe_others(field);
  } else {
    for (const auto& any : names_of(field)) describe_others(any.value);
  }
}

template <class Section>
void KeyNames::model(const char* name, ModelName& field, ModelRegistry<Section> Models::*list,
                     Section& section) {
  const ModelRegistry<Section>& registry = map_.places.models().*list;
  add(name);
  if (find_key(map_.node, name) >= 0)
    MapReader(map_).key(kOptional, name, field, list_names(registry), list_models(registry));
  find_model_keys(registry, field).describe(*this, section);
  std::map<std::string, std::string> owners;  // of each key
  const auto note = [&](const ModelKeys<Section>& keys, const std::string& owner) {
    KeyNames others(map_);
    Section scratch;
    keys.describe(others, scratch);
    for (const std::string& key : others.names())
      owners[key] += (owners[key].empty() ? "" : " or ") + owner;
  };
  for (const auto& [other, keys] : registry) note(*keys, name + (" '" + other + "'"));
  note(find_model_keys(registry, ModelName{"any.so", ""}), "shared libraries");
  for (const auto& [key, all] : owners)
    owners_.emplace(key, "a key of " + all + ", here " + name + " is '" + field.name + "'");
}

/// The bytes of a file; `kind` names it in errors: `a scenario file`.
/// @throws ConfigError for a file that is empty, cannot be read, or has more than `most` bytes.
std::string read_config_file(const std::filesystem::path& file, const std::string& kind,
                             std::size_t most = kMaxScenarioBytes);

/// The scenario in `root`, the tree of a file with this text; checked as load_scenario does.
Scenario read_scenario(const YamlNode& root, const std::string& place, const std::string& text,
                       const Models& models);

}  // namespace sls::config
