/// Permissions to view and to operate. Pure: no network.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sls::view {

struct AccessOptions {
  std::string address = "127.0.0.1";  ///< address of the listening socket
  std::optional<std::string> token;   ///< from --token-file
  bool is_read_only = false;
  std::vector<std::string> allowed_origins;  ///< --allow-origin: foreign pages that may view
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
  /// Reason of a refusal: of viewing, the text of the answer 403; of operating, the text on the
  /// page.
  std::string reason;
};

/// @throws config::ConfigError: an address that is not loopback needs a token; an entry of
/// --allow-origin is SCHEME://HOST[:PORT], never `null`.
void check(const AccessOptions& options);

/// Host must be localhost, a loopback address, or the address of the listening socket (any IP
/// address if that is 0.0.0.0 or ::), with any port. Otherwise a page of a foreign name could reach
/// us (DNS rebinding). Origin, if present, must have the host and port of Host, or be an allowed
/// one. If a token is set, operating requires it. A token must be set for an address that is not
/// loopback, and for an allowed page to operate.
Access judge(const RequestOrigin& request, const AccessOptions& options);

/// Compares in a time that does not depend on the place of the first difference.
bool is_same_token(std::string_view given, std::string_view expected);

/// Slows guesses of the token: after `kFree` wrong ones a network gets one try each `kInterval`, on
/// however many connections.
class TokenTries {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr int kFree = 5;
  static constexpr std::chrono::seconds kInterval{1};
  static constexpr std::size_t kMostNetworks = 1000;

  /// Time until a token from `network` may be judged; at most 0 if it may be now.
  Clock::duration find_wait(const std::string& network, Clock::time_point now) const;
  void note_wrong(const std::string& network, Clock::time_point now);

 private:
  std::map<std::string, Clock::time_point> until_;  ///< its wrong tokens are forgotten
};

/// The token of --token-file: its first line. @throws config::ConfigError: expected a file of mode
/// 0600 or stricter whose first line has 16 to 256 printable characters.
std::string load_token(const std::string& path);

}  // namespace sls::view
