/// Parses texts of a client's request. Pure: no network.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace sls::view {

/// ASCII letters in lower case.
std::string to_lower(std::string_view text);

/// `text` for use in one line of an answer: at most 80 characters; '?' replaces every character
/// that is not printable ASCII.
std::string quote(std::string_view text);

/// The target of a request.
struct Target {
  std::string path;                  ///< not decoded: only exact paths are served
  std::optional<std::string> token;  ///< the first ?token=…, decoded
};

/// Returns nothing if it does not have the form /PATH[?QUERY], or if the token's percent-encoding
/// is wrong.
std::optional<Target> parse_target(std::string_view target);

}  // namespace sls::view
