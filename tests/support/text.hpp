#pragma once

#include <stdexcept>
#include <string>

namespace sls::test {

inline bool holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// `text` with its only occurrence of `from` replaced by `to`.
/// @throws std::logic_error if there is not exactly one.
inline std::string replace_once(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  if (at == text.npos || text.find(from, at + 1) != text.npos)
    throw std::logic_error("not there exactly once: " + from);
  return text.replace(at, from.size(), to);
}

}  // namespace sls::test
