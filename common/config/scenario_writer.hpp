/// Writes the keys that scenario_keys.hpp describes as YAML, every one of them.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/config/numbers.hpp"
#include "common/config/scenario_keys.hpp"

namespace sls::config {

inline std::string to_yaml_value(double number) { return to_text(number); }
inline std::string to_yaml_value(std::int64_t nanoseconds) {
  return to_text(to_seconds(nanoseconds));
}
inline std::string to_yaml_value(int number) { return std::to_string(number); }
inline std::string to_yaml_value(std::uint64_t number) { return std::to_string(number); }
inline std::string to_yaml_value(bool flag) { return flag ? "true" : "false"; }
inline std::string to_yaml_value(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text)
    quoted += (c == '"' || c == '\\') ? std::string("\\") + c : std::string(1, c);
  return quoted + '"';
}
inline std::string to_yaml_value(const Eigen::Vector3d& vector) {
  return "[" + to_text(vector.x()) + ", " + to_text(vector.y()) + ", " + to_text(vector.z()) + "]";
}
inline std::string to_yaml_value(const Eigen::Vector2d& vector) {
  return "[" + to_text(vector.x()) + ", " + to_text(vector.y()) + "]";
}
inline std::string to_yaml_value(const Eigen::Quaterniond& q) {
  return "[" + to_text(q.w()) + ", " + to_text(q.x()) + ", " + to_text(q.y()) + ", " +
         to_text(q.z()) + "]";
}
inline std::string to_yaml_value(const ModelName& model) { return to_yaml_value(model.name); }
inline std::string to_yaml_value(const LibraryParameters& parameters) { return parameters.json; }
template <class Enum, std::enable_if_t<std::is_enum_v<Enum>, int> = 0>
std::string to_yaml_value(Enum value) {
  for (const auto& name : names_of(value))
    if (name.value == value) return name.text;
  return "";
}

inline std::string to_yaml_value(const std::vector<RecordFormat>& formats) {
  std::string list;
  for (const RecordFormat format : formats)
    list += (list.empty() ? "" : ", ") + to_yaml_value(format);
  return "[" + list + "]";
}

/// True for a field that is written on the line of its key.
template <class Field>
inline constexpr bool kOnOneLine =
    std::is_arithmetic_v<Field> || std::is_enum_v<Field> || std::is_same_v<Field, std::string> ||
    std::is_same_v<Field, Eigen::Vector3d> || std::is_same_v<Field, Eigen::Vector2d> ||
    std::is_same_v<Field, Eigen::Quaterniond> || std::is_same_v<Field, ModelName> ||
    std::is_same_v<Field, LibraryParameters> || std::is_same_v<Field, std::vector<RecordFormat>>;

/// The `Map` that writes: describe(writer, field) appends `field` to the text.
class MapWriter {
 public:
  MapWriter(std::string& text, const Models& models, std::string indentation = "")
      : MapWriter(text, models, indentation, indentation) {}

  template <class Field, class... Rule>
  void key(Presence, const char* name, Field& field, const Rule&... rule) {
    // A plain `on` is true to readers of YAML 1.1.
    text_ += next_ + (name == std::string_view("on") ? "\"on\"" : name) + ":";
    next_ = indentation_;
    if constexpr (kOnOneLine<Field>) {
      text_ += " " + to_yaml_value(field) + "\n";
    } else {
      write_block(field, rule...);
    }
  }

  /// Leaves out an empty list that could not be read.
  template <class Element>
  void key(Presence, const char* name, std::vector<Element>& list, const ListRange& range) {
    if (list.empty() && range.least > 0) return;
    text_ += next_ + name + ":";
    next_ = indentation_;
    write_block(list, range);
  }

  /// Optional parts of the file.
  template <class Field, class... Rule>
  void key(Presence presence, const char* name, std::optional<Field>& field, const Rule&... rule) {
    if (field) key(presence, name, *field, rule...);
  }

  template <class Choice>
  void choose(Choice&, std::initializer_list<Alternative<Choice>>) {}

  template <class Enum, class DescribeOthers>
  void decide(const char* name, Enum& field, const DescribeOthers& describe_others) {
    key(kRequired, name, field);
    describe_others(field);
  }

  template <class Section>
  void model(const char* name, ModelName& field, ModelRegistry<Section> Models::*list,
             Section& section) {
    key(kOptional, name, field);
    find_model_keys(models_.*list, field).describe(*this, section);
  }

  template <class Field>
  void by_default(Field&, const Field&) {}

 private:
  MapWriter(std::string& text, const Models& models, std::string first, std::string indentation)
      : text_(text),
        models_(models),
        next_(std::move(first)),
        indentation_(std::move(indentation)) {}

  template <class Struct, class... Rule>
  void write_block(Struct& fields, const Rule&... rule) {
    text_ += "\n";
    MapWriter writer(text_, models_, indentation_ + "  ");
    describe(writer, fields, rule...);
  }

  template <class Element>
  void write_block(std::vector<Element>& list, const ListRange&) {
    text_ += list.empty() ? " []\n" : "\n";
    for (Element& element : list) {
      MapWriter writer(text_, models_, indentation_ + "  - ", indentation_ + "    ");
      describe(writer, element);
    }
  }

  std::string& text_;
  const Models& models_;
  std::string next_;         // beginning of the next line: for an item of a list with a dash
  std::string indentation_;  // beginning of the lines after it
};

}  // namespace sls::config
