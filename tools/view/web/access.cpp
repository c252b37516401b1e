#include "tools/view/web/access.hpp"

#include <openssl/crypto.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "common/config/config_error.hpp"
#include "common/text/sha256.hpp"
#include "tools/view/web/asio.hpp"
#include "tools/view/web/request_text.hpp"

namespace sls::view {
namespace {

constexpr std::size_t kLeastToken = 16;
constexpr std::size_t kMostToken = 256;

// --- addresses -----------------------------------------------------------------------------------

using net::ip::address;

/// An address without a scope. IPv4 in IPv6 is IPv4, so that both families compare alike.
std::optional<address> parse_ip(const std::string& text) {
  Error error;
  const address ip = net::ip::make_address(text, error);
  if (error || text.find('%') != std::string::npos) return std::nullopt;
  return unmap(ip);
}

/// HOST[:PORT] of a header.
struct Authority {
  std::string host;  ///< lower case, without the brackets of IPv6
  std::optional<address> ip;
  std::optional<std::uint16_t> port;
};

std::optional<std::uint16_t> parse_port(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return port;
}

bool is_host_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '.' || c == '_';
}

std::optional<Authority> parse_authority(std::string_view text) {
  Authority authority;
  std::string_view port;
  if (!text.empty() && text.front() == '[') {
    const auto end = text.find(']');
    if (end == std::string_view::npos) return std::nullopt;
    authority.host = to_lower(text.substr(1, end - 1));
    authority.ip = parse_ip(authority.host);
    if (!authority.ip || authority.host.find(':') == std::string::npos) return std::nullopt;
    port = text.substr(end + 1);
  } else {
    const auto end = std::min(text.find(':'), text.size());
    authority.host = to_lower(text.substr(0, end));
    authority.ip = parse_ip(authority.host);
    if (authority.host.empty() ||
        !std::all_of(authority.host.begin(), authority.host.end(), is_host_character))
      return std::nullopt;
    port = text.substr(end);
  }
  if (port.empty()) return authority;
  if (port.front() != ':') return std::nullopt;
  authority.port = parse_port(port.substr(1));
  if (!authority.port) return std::nullopt;
  return authority;
}

bool is_loopback_address(const std::string& address) {
  if (to_lower(address) == "localhost") return true;
  const auto ip = parse_ip(address);
  return ip && ip->is_loopback();
}

bool is_own_host(const Authority& host, const std::string& listened) {
  if (!host.ip) return host.host == "localhost";
  if (host.ip->is_loopback()) return true;
  const auto own = parse_ip(listened);
  return own && (*own == *host.ip || own->is_unspecified());
}

// --- origins -------------------------------------------------------------------------------------

/// SCHEME://HOST[:PORT]. For a scheme other than http and https only the text is compared.
struct Origin {
  std::string text;  ///< lower case
  std::optional<Authority> authority;
  std::uint16_t default_port = 0;
};

std::optional<Origin> parse_origin(std::string_view text) {
  Origin origin{to_lower(text), std::nullopt, 0};
  const auto scheme_end = origin.text.find("://");
  if (scheme_end == 0 || scheme_end == std::string::npos) return std::nullopt;
  const std::string scheme = origin.text.substr(0, scheme_end);
  if (scheme != "http" && scheme != "https") return origin;
  origin.default_port = scheme == "http" ? 80 : 443;
  origin.authority = parse_authority(std::string_view(origin.text).substr(scheme_end + 3));
  if (!origin.authority) return std::nullopt;
  return origin;
}

/// True for the same host and port. A missing port is the default port of the scheme.
bool is_at(const Origin& origin, const Authority& host, std::uint16_t default_port) {
  const Authority& page = *origin.authority;
  const bool is_same_host = page.ip || host.ip ? page.ip == host.ip : page.host == host.host;
  return is_same_host &&
         page.port.value_or(origin.default_port) == host.port.value_or(default_port);
}

bool is_same_origin(const Origin& a, const Origin& b) {
  if (!a.authority || !b.authority) return a.text == b.text;
  return a.default_port == b.default_port && is_at(a, *b.authority, b.default_port);
}

bool is_allowed(const Origin& origin, const std::vector<std::string>& allowed) {
  return std::any_of(allowed.begin(), allowed.end(), [&origin](const std::string& text) {
    const auto other = parse_origin(text);
    return other && is_same_origin(origin, *other);
  });
}

Access refuse(std::string reason) { return {false, false, std::move(reason)}; }

/// Further permissions of a request that may view.
Access judge_operating(const RequestOrigin& request, const AccessOptions& options,
                       bool is_foreign) {
  if (options.is_read_only) return {true, false, "started with --read-only"};
  if (is_foreign && !options.token)
    return {true, false, "a page of --allow-origin may only look without --token-file"};
  if (!options.token) {
    if (is_loopback_address(options.address)) return {true, true, ""};
    return {true, false, "started without --token-file"};
  }
  if (!request.token) return {true, false, "expected a token"};
  if (!is_same_token(*request.token, *options.token)) return {true, false, "wrong token"};
  return {true, true, ""};
}

// --- the token's file ----------------------------------------------------------------------------

[[noreturn]] void fail_token(const std::string& path, const std::string& expected,
                             const std::string& got) {
  throw config::ConfigError(
      fmt::format("--token-file: {}: expected {}, got {}", path, expected, got));
}

/// The file's first line. A line that is too long is cut, but only after the limit, so that the
/// caller detects it.
std::string read_first_line(const std::string& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (error) fail_token(path, "a file that can be read", error.message());
  if (!is_regular_file(status)) fail_token(path, "a regular file", "another kind");
  const auto mode = static_cast<unsigned>(status.permissions());
  if ((mode & 077) != 0)
    fail_token(path, "mode 0600 or stricter", fmt::format("{:04o}", mode & 07777));
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail_token(path, "a file that can be read", std::strerror(errno));
  std::string line(kMostToken + 3, '\0');
  stream.read(line.data(), static_cast<std::streamsize>(line.size()));
  line.resize(static_cast<std::size_t>(stream.gcount()));
  line.erase(std::min(line.find('\n'), line.size()));
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return line;
}

}  // namespace

void check(const AccessOptions& options) {
  if (!options.token && !is_loopback_address(options.address))
    throw config::ConfigError(
        fmt::format("--listen: expected a loopback address, or --token-file with it, got {}",
                    quote(options.address)));
  for (const std::string& origin : options.allowed_origins)
    if (!parse_origin(origin))
      throw config::ConfigError(
          fmt::format("--allow-origin: expected SCHEME://HOST[:PORT], got '{}'", quote(origin)));
}

Access judge(const RequestOrigin& request, const AccessOptions& options) {
  if (request.host.empty()) return refuse("expected a header Host, got none");
  const auto host = parse_authority(request.host);
  if (!host || !is_own_host(*host, options.address))
    return refuse(fmt::format("expected Host {}, localhost or a loopback address, got '{}'",
                              options.address, quote(request.host)));
  bool is_foreign = false;
  if (request.origin) {
    const auto origin = parse_origin(*request.origin);
    const bool is_own = origin && origin->authority && is_at(*origin, *host, origin->default_port);
    is_foreign = !is_own;
    if (is_foreign && !(origin && is_allowed(*origin, options.allowed_origins)))
      return refuse(fmt::format("expected a page of {} or of --allow-origin, got Origin '{}'",
                                quote(request.host), quote(*request.origin)));
  }
  return judge_operating(request, options, is_foreign);
}

bool is_same_token(std::string_view given, std::string_view expected) {
  // Digests have one length, and the place of their first difference gives no information about the
  // tokens.
  text::Sha256 given_hash;
  text::Sha256 expected_hash;
  given_hash.add(given);
  expected_hash.add(expected);
  const auto a = given_hash.finish();
  const auto b = expected_hash.finish();
  return ::CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

TokenTries::Clock::duration TokenTries::find_wait(const std::string& network,
                                                  Clock::time_point now) const {
  const auto found = until_.find(network);
  return found == until_.end() ? -kInterval : found->second - (kFree - 1) * kInterval - now;
}

void TokenTries::note_wrong(const std::string& network, Clock::time_point now) {
  for (auto at = until_.begin(); at != until_.end();)
    at = at->second <= now ? until_.erase(at) : std::next(at);
  if (until_.size() >= kMostNetworks) until_.erase(until_.begin());
  auto& until = until_.emplace(network, now).first->second;
  until += kInterval;
}

std::string load_token(const std::string& path) {
  const std::string line = read_first_line(path);
  const std::string expected = fmt::format("{} to {} printable characters without spaces in line 1",
                                           kLeastToken, kMostToken);
  if (!std::all_of(line.begin(), line.end(), [](char c) { return c > ' ' && c <= '~'; }))
    fail_token(path, expected, "other characters");
  if (line.size() > kMostToken) fail_token(path, expected, "more");
  if (line.size() < kLeastToken) fail_token(path, expected, std::to_string(line.size()));
  return line;
}

}  // namespace sls::view
