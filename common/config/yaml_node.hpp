/// YAML text as a plain tree; every node has its line. No other code uses yaml-cpp.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/config/config_error.hpp"

namespace sls::config {

/// The content of one place in the file.
struct YamlNode {
  enum class Kind { kNothing, kScalar, kList, kMap };

  Kind kind = Kind::kNothing;
  int line = 0;                 ///< from 1
  bool quoted = false;          ///< a scalar in quotes or a block scalar: text, never a number
  std::string text;             ///< of a scalar
  std::vector<YamlNode> keys;   ///< of a map, one for each item
  std::vector<YamlNode> items;  ///< of a list or a map
};

/// The tree of `text`, which must be UTF-8 and hold one document without anchors, aliases and tags.
/// Nesting is limited. Duplicate keys are kept: the reader refuses them.
/// @throws ConfigError `PLACE:LINE: …`.
YamlNode parse_yaml(const std::string& text, const std::string& place);

/// The content of `node` in a few printable characters: `-0.16`, `"abc"`, `a list of 2`, `nothing`.
std::string to_brief(const YamlNode& node);

/// True if `text` is well-formed UTF-8.
bool is_utf8(const std::string& text);

/// `text`, cut after about `most` characters. Escapes all characters except printable ASCII.
std::string to_printable(const std::string& text, std::size_t most = 40);

/// `PLACE:LINE: PATH: MESSAGE`; a line below 1 and an empty path are left out.
ConfigError make_error(const std::string& place, int line, const std::string& path,
                       const std::string& message);

}  // namespace sls::config
