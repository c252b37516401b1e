/// Shared by the connections of one server. Used on the server's thread only, except `websockets`.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "tools/view/web/asio.hpp"
#include "tools/view/web/server.hpp"

namespace sls::view {

/// A TCP connection to a client.
class Client {
 public:
  explicit Client(const Socket& socket);
  virtual ~Client() = default;
  /// The network of the client: its IPv4 address, the first 64 bits of its IPv6 address
  /// ("fe80::/64"), or "loopback".
  const std::string address;
  std::uint64_t number = 0;  ///< ascending in order of arrival

  virtual bool may_operate() const { return false; }
  /// Bytes that wait until the client reads.
  virtual std::size_t waiting_bytes() const { return 0; }
  /// Drops the waiting messages that may be dropped; if there are none, all, and closes the
  /// connection. Does not end the session within this call.
  virtual void relieve() {}
  /// Called when the server ends; tells the client if the protocol can.
  virtual void shut_down() = 0;
  /// Closes the socket and ends the session.
  virtual void drop() = 0;
};

class Hub {
 public:
  Hub(const AccessOptions& access_options, const ServerLimits& server_limits)
      : access(access_options), limits(server_limits) {}

  /// First member, so that it is destroyed last: its handlers hold connections.
  net::io_context io{1};
  const AccessOptions access;
  const ServerLimits limits;
  std::map<std::string, MakeResource, std::less<>> resources;
  std::vector<Protocol> protocols;
  std::atomic<std::size_t> websockets{0};
  std::size_t waiting_bytes = 0;  ///< sum over the clients

  /// Serves an accepted connection. Beyond a limit of connections it takes the place of another.
  void adopt(Socket socket);
  /// Relieves those clients that read slowest until limits.all_queues_bytes hold again.
  void limit_queues();
  void add(std::shared_ptr<Client> client);
  void remove(Client* client);
  std::size_t count_clients() const { return clients_.size(); }

  /// Logs a problem of a client, at most every 10 s, because clients must not fill the log.
  void warn(const std::string& text);

  /// Calls `judge` when a token of `client` may be judged, unless its connection ends before.
  void judge_token(const std::weak_ptr<Client>& client, std::function<void()> judge);
  /// Logs wrong tokens, at most every 10 s.
  void note_wrong_token(const std::string& network);

  /// Shuts all down and calls `done` once they have ended.
  void shut_down(std::function<void()> done);
  void drop_all();

 private:
  void make_room(const std::string& address);

  std::unordered_map<Client*, std::shared_ptr<Client>> clients_;
  std::uint64_t next_number_ = 1;
  std::function<void()> done_;
  std::chrono::steady_clock::time_point next_warning_, next_token_warning_;
  TokenTries tries_;
  std::uint64_t wrong_tokens_ = 0;
};

}  // namespace sls::view
