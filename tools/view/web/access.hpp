/// Permissions to view and to operate. Pure: no network.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sls::view {

struct AccessOptions {
  std::string address = "127.0.0.1";  ///< listened on
  std::optional<std::string> token;   ///< from --token-file
  bool is_read_only = false;
  std::vector<std::string> allowed_origins;  ///< --allow-origin: foreign pages that may look
};

/// A request's headers that identify its sender.
struct RequestOrigin {
  std::string host;                   ///< header Host
  std::optional<std::string> origin;  ///< header Origin; browsers always send it with WebSockets
  std::optional<std::string> token;  ///< query ?token=… of the target, or what `authenticate` got
};

struct Access {
  bool may_look = false;
  bool may_operate = false;
  /// Why not: of looking, the text of the 403; of operating, what the page shows.
  std::string reason;
};

/// @throws config::ConfigError: an address that is not loopback needs a token; an entry of
/// --allow-origin is SCHEME://HOST[:PORT], never `null`.
void check(const AccessOptions& options);

/// Host must be the address listened on (any IP address where that is 0.0.0.0 or ::), localhost or
/// a loopback address, with any port (else a page of a foreign name could reach us: DNS
/// rebinding); Origin, where there is one, the same or an allowed one. The same is the same host
/// and port as in Host. Operating needs, where a token is set, that token. A token must be set for
/// an address that is not loopback, and for an allowed page to operate.
Access judge(const RequestOrigin& request, const AccessOptions& options);

/// In time that does not depend on where they differ.
bool is_same_token(std::string_view given, std::string_view expected);

/// The token of --token-file: its first line. @throws config::ConfigError: expected a file of mode
/// 0600 or stricter whose first line has 16 to 256 printable characters.
std::string load_token(const std::string& path);

}  // namespace sls::view
