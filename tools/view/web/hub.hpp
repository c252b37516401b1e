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
  virtual ~Client() = default;
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
  std::map<std::string, Resource, std::less<>> resources;
  std::vector<Protocol> protocols;
  std::atomic<std::size_t> websockets{0};

  /// Serves an accepted connection; closes it if there are limits.connections already.
  void adopt(Socket socket);
  void add(std::shared_ptr<Client> client);
  void remove(Client* client);
  std::size_t count_clients() const { return clients_.size(); }

  /// Logs a problem of a client, at most every 10 s, because clients must not fill the log.
  void warn(const std::string& text);

  /// Shuts all down and calls `done` once they have ended.
  void shut_down(std::function<void()> done);
  void drop_all();

 private:
  std::unordered_map<Client*, std::shared_ptr<Client>> clients_;
  std::function<void()> done_;
  std::chrono::steady_clock::time_point next_warning_;
};

}  // namespace sls::view
