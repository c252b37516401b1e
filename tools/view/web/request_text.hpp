/// Texts of a request: what a client wrote, taken apart. Pure.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace sls::view {

/// ASCII letters in lower case.
std::string to_lower(std::string_view text);

/// `text` as it may stand in one line of an answer: at most 80 characters, others than printable
/// ASCII as '?'.
std::string quote(std::string_view text);

/// The target of a request.
struct Target {
  std::string path;                  ///< as it came: only exact paths are served
  std::optional<std::string> token;  ///< the first ?token=…, decoded
};

/// Nothing if it is not of the form /PATH[?QUERY], or the token's percent code is broken.
std::optional<Target> parse_target(std::string_view target);

}  // namespace sls::view
