/// Lists the keys that scenario_keys.hpp describes, for docs/reference/scenario.md.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/config/scenario_keys.hpp"
#include "common/config/scenario_writer.hpp"

namespace sls::config {

/// One key. `[i]` in a path stands for any element of a list.
struct ListedKey {
  std::string path;
  std::string type;
  std::string range;          ///< empty: every value of the type
  std::string default_value;  ///< empty where there is none
  std::string presence;       ///< "required", "optional" or "one of a, b"
  std::string condition;      ///< value of another key that it requires; empty: none
};

/// The alternatives that the calls of map.choose in one map take. Goes through all combinations.
class Alternatives {
 public:
  std::size_t take(std::size_t count) {
    if (next_ == taken_.size()) taken_.push_back({0, count});
    return taken_[next_++].index;
  }
  /// False after the last combination.
  bool advance() {
    next_ = 0;
    while (!taken_.empty() && ++taken_.back().index == taken_.back().count) taken_.pop_back();
    return !taken_.empty();
  }

 private:
  struct Taken {
    std::size_t index;
    std::size_t count;
  };
  std::vector<Taken> taken_;
  std::size_t next_ = 0;
};

/// The `Map` that lists: describe(lister, field) appends the keys of `field`. The values in `field`
/// are the defaults.
class KeyLister {
 public:
  KeyLister(std::vector<ListedKey>& keys, const Models& models, std::string prefix,
            Alternatives& alternatives)
      : keys_(keys), models_(models), prefix_(std::move(prefix)), alternatives_(alternatives) {}

  template <class Field, class... Rule>
  void key(Presence presence, const char* name, Field& field, const Rule&... rule) {
    if constexpr (kOnOneLine<Field>) {
      const bool has_default = presence == kOptional;
      add(presence, name, type_of(field), to_range(rule...),
          has_default ? to_yaml_value(field) : std::string());
    } else {
      list_block(presence, name, field, rule...);
    }
  }

  template <class Field, class... Rule>
  void key(Presence presence, const char* name, std::optional<Field>& field, const Rule&... rule) {
    if constexpr (kOnOneLine<Field>) {
      add(presence, name, type_of(Field{}), to_range(rule...),
          !field                  ? "none"
          : presence == kOptional ? to_yaml_value(*field)
                                  : std::string());
    } else {
      Field value = field.value_or(Field{});
      const std::size_t before = keys_.size();
      list_block(presence, name, value, rule...);
      if (!field && keys_.size() > before) keys_[before].default_value = "none";
    }
  }

  template <class Choice>
  void choose(Choice& choice, std::initializer_list<Alternative<Choice>> alternatives) {
    std::string all;
    for (const auto& alternative : alternatives) {
      std::string together;
      for (const char* name : alternative.keys)
        together += (together.empty() ? "" : "+") + std::string(name);
      all += (all.empty() ? "" : ", ") + together;
    }
    for (const auto& alternative : alternatives)
      for (const char* name : alternative.keys) one_of_.emplace_back(name, "one of " + all);
    choice = alternatives.begin()[alternatives_.take(alternatives.size())].value;
  }

  template <class Enum, class DescribeOthers>
  void decide(const char* name, Enum& field, const DescribeOthers& describe_others) {
    key(kRequired, name, field);
    std::vector<Group> groups;
    for (const auto& any : names_of(field)) {
      groups.push_back({any.text, {}});
      std::swap(keys_, groups.back().keys);
      describe_others(any.value);
      std::swap(keys_, groups.back().keys);
    }
    add_groups(name, groups);
  }

  template <class Section>
  void model(const char* name, ModelName& field, ModelRegistry<Section> Models::*registered,
             Section& section) {
    const ModelRegistry<Section>& registry = models_.*registered;
    add(kOptional, name, "name or path", list_models(registry), to_yaml_value(field));
    std::vector<Group> groups;
    const auto list = [&](const std::string& text, const ModelKeys<Section>& model_keys) {
      groups.push_back({text, {}});
      std::swap(keys_, groups.back().keys);
      Section scratch = section;
      scratch.own = {};
      model_keys.describe(*this, scratch);
      std::swap(keys_, groups.back().keys);
    };
    for (const auto& [text, model_keys] : registry) list(text, *model_keys);
    list("a shared library", find_model_keys(registry, ModelName{"any.so", ""}));
    add_groups(name, groups);
  }

  template <class Field>
  void by_default(Field& field, const Field& value) {
    field = value;
  }

 private:
  /// The keys that are allowed with one value of a key.
  struct Group {
    std::string value;
    std::vector<ListedKey> keys;
  };

  static bool are_alike(const ListedKey& a, const ListedKey& b) {
    return a.path == b.path && a.type == b.type && a.range == b.range &&
           a.default_value == b.default_value && a.presence == b.presence;
  }

  /// Keys that are allowed with every value have no condition.
  void add_groups(const std::string& decider, const std::vector<Group>& groups) {
    std::vector<std::pair<ListedKey, std::vector<std::string>>> found;
    for (const Group& group : groups)
      for (const ListedKey& listed : group.keys) {
        auto it = found.begin();
        while (it != found.end() && !are_alike(it->first, listed)) ++it;
        if (it == found.end()) it = found.insert(it, {listed, {}});
        it->second.push_back(group.value);
      }
    for (auto& [listed, values] : found) {
      if (values.size() < groups.size()) {
        std::string joined;
        for (const std::string& value : values) joined += (joined.empty() ? "" : ", ") + value;
        listed.condition = decider + ": " + joined;
      }
      keys_.push_back(listed);
    }
  }

  void add(Presence presence, const std::string& name, std::string type, std::string range,
           std::string default_value) {
    ListedKey listed{prefix_ + name,           std::move(type), std::move(range),
                     std::move(default_value), "optional",      {}};
    if (presence == kRequired) listed.presence = "required";
    for (const auto& [one, text] : one_of_)
      if (one == name) listed.presence = text;
    for (const ListedKey& known : keys_)
      if (are_alike(known, listed)) return;
    keys_.push_back(std::move(listed));
  }

  template <class Struct, class... Rule>
  void list_keys(const std::string& prefix, Struct& fields, const Rule&... rule) {
    Alternatives alternatives;
    std::vector<ListedKey> of_block;
    do {
      Struct scratch = fields;
      KeyLister lister(of_block, models_, prefix, alternatives);
      describe(lister, scratch, rule...);
    } while (alternatives.advance());
    for (ListedKey& listed : of_block) {
      bool is_known = false;
      for (const ListedKey& known : keys_) is_known = is_known || are_alike(known, listed);
      if (!is_known) keys_.push_back(std::move(listed));
    }
  }

  template <class Struct, class... Rule>
  void list_block(Presence presence, const std::string& name, Struct& fields, const Rule&... rule) {
    add(presence, name, "map", "", "");
    list_keys(prefix_ + name + ".", fields, rule...);
  }

  template <class Element>
  void list_block(Presence presence, const std::string& name, std::vector<Element>&,
                  const ListRange& range) {
    constexpr bool kIsFleet = std::is_same_v<Element, VehicleVariant>;
    add(presence, name, kIsFleet ? "whole number, or list of maps" : "list of maps",
        std::to_string(range.least) + " to " + std::to_string(range.most) + " " + range.elements,
        presence == kOptional ? "[]" : "");
    Element element{};
    list_keys(prefix_ + name + "[i].", element);
  }

  template <class Field>
  static std::string type_of(const Field& field) {
    if constexpr (std::is_enum_v<Field>) {
      std::string names;
      for (const auto& name : names_of(field))
        names += (names.empty() ? "" : ", ") + std::string(name.text);
      return names;
    }
    if constexpr (std::is_same_v<Field, bool>) return "true, false";
    if constexpr (std::is_same_v<Field, std::int64_t>) return "time";
    if constexpr (std::is_integral_v<Field>) return "whole number";
    if constexpr (std::is_floating_point_v<Field>) return "number";
    if constexpr (std::is_same_v<Field, std::string>) return "text";
    if constexpr (std::is_same_v<Field, Eigen::Vector3d>) return "vector";
    if constexpr (std::is_same_v<Field, Eigen::Vector2d>) return "list of 2 numbers";
    if constexpr (std::is_same_v<Field, Eigen::Quaterniond>) return "list w, x, y, z";
    if constexpr (std::is_same_v<Field, std::vector<RecordFormat>>) {
      std::string names;
      for (const auto& name : names_of(RecordFormat{}))
        names += (names.empty() ? "" : ", ") + std::string(name.text);
      return "list of " + names;
    }
    return "map";
  }

  static std::string to_range() { return {}; }
  static std::string to_range(const NumberRule& rule) {
    return rule.expectation == kFinite.expectation ? std::string() : rule.expectation;
  }
  static std::string to_range(const TextRule& rule) { return rule.expectation; }
  static std::string to_range(const Range& range) {
    return std::to_string(range.least) + " to " + std::to_string(range.most);
  }
  static std::string to_range(const WideRange& range) {
    return std::to_string(range.least) + " to " + std::to_string(range.most);
  }

  std::vector<ListedKey>& keys_;
  const Models& models_;
  std::string prefix_;
  Alternatives& alternatives_;
  std::vector<std::pair<std::string, std::string>> one_of_;  // names and their presence
};

/// Every key of a `Root`, in the order of its description.
template <class Root>
std::vector<ListedKey> list_keys_of(const Models& models) {
  std::vector<ListedKey> keys;
  Alternatives alternatives;
  KeyLister lister(keys, models, "", alternatives);
  Root root;
  describe(lister, root);
  return keys;
}

/// Every key of a scenario, in the order of scenario_keys.hpp.
inline std::vector<ListedKey> list_scenario_keys(const Models& models = all_models()) {
  return list_keys_of<Scenario>(models);
}

}  // namespace sls::config
