#include "tools/view/web/request_text.hpp"

#include <algorithm>
#include <charconv>

namespace sls::view {
namespace {

constexpr std::size_t kMostQuoted = 80;

std::optional<std::string> decode_percent(std::string_view text) {
  std::string decoded;
  while (!text.empty()) {
    if (text.front() != '%') {
      decoded += text.front();
      text.remove_prefix(1);
      continue;
    }
    unsigned char byte = 0;
    if (text.size() < 3) return std::nullopt;
    const auto [end, error] = std::from_chars(text.data() + 1, text.data() + 3, byte, 16);
    if (error != std::errc() || end != text.data() + 3) return std::nullopt;
    decoded += static_cast<char>(byte);
    text.remove_prefix(3);
  }
  return decoded;
}

/// The value of the first parameter `name`, not decoded.
std::optional<std::string_view> find_parameter(std::string_view query, std::string_view name) {
  while (!query.empty()) {
    const std::string_view parameter = query.substr(0, query.find('&'));
    if (parameter.size() > name.size() && parameter.substr(0, name.size()) == name &&
        parameter[name.size()] == '=')
      return parameter.substr(name.size() + 1);
    query.remove_prefix(std::min(parameter.size() + 1, query.size()));
  }
  return std::nullopt;
}

}  // namespace

std::string to_lower(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

std::string quote(std::string_view text) {
  std::string quoted(text.substr(0, kMostQuoted));
  for (char& c : quoted)
    if (c < ' ' || c > '~') c = '?';
  return text.size() > kMostQuoted ? quoted + "..." : quoted;
}

std::optional<Target> parse_target(std::string_view target) {
  if (target.empty() || target.front() != '/') return std::nullopt;
  const auto path_end = std::min(target.find('?'), target.size());
  Target parsed{std::string(target.substr(0, path_end)), std::nullopt};
  const std::string_view query = target.substr(std::min(path_end + 1, target.size()));
  if (const auto token = find_parameter(query, "token")) {
    parsed.token = decode_percent(*token);
    if (!parsed.token) return std::nullopt;
  }
  return parsed;
}

}  // namespace sls::view
