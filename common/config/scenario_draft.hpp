/// A scenario file with some of its values replaced, by a campaign or by a Python call.
#pragma once

#include <filesystem>
#include <string>

#include "common/config/scenario.hpp"
#include "common/config/yaml_node.hpp"

namespace sls::config {

class ScenarioDraft {
 public:
  /// Reads `file`, which may still hold mistakes: `make_scenario` finds them.
  /// @throws ConfigError for a file that cannot be read or is no YAML.
  explicit ScenarioDraft(const std::filesystem::path& file);
  /// The same from text; `place` stands for the file's name in messages, and paths in the scenario
  /// are relative to `folder`.
  ScenarioDraft(const std::string& text, std::string place, std::filesystem::path folder);

  /// Puts the YAML `value` at `path`: keys and, of a list, indices from 0, separated by dots, such
  /// as `vehicle.load_mass_kg` or `faults.0.delay.by_s`. Keys that the file leaves out are added.
  /// @throws ConfigError naming file, line and path if a list has no such item, if a part of the
  ///   path before the last is a number or a text, or if `value` is no YAML.
  void set(const std::string& path, const std::string& value);

  /// The scenario, checked like a file. Its `text` is `to_text()`, so that a file with this text is
  /// the same scenario.
  /// @throws ConfigError as load_scenario does. Lines are those of the file that was read.
  Scenario make_scenario(const Models& models = all_models()) const;

  /// The file's values and the replaced ones as YAML, without comments.
  std::string to_text() const;

 private:
  std::string place_;
  std::filesystem::path folder_;
  YamlNode root_;
};

}  // namespace sls::config
