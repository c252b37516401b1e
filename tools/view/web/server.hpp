/// The server of sls_view: files from memory and WebSocket protocols on one port, by Boost.Beast,
/// on one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "tools/view/web/access.hpp"
#include "tools/view/web/connection.hpp"

namespace sls::view {

/// The answer for a path: bytes that do not change while the server runs.
struct Resource {
  std::string content_type;  ///< "text/html; charset=utf-8"
  Payload body;
  Payload gzip_body;            ///< the same for clients that take gzip, or null
  std::string security_policy;  ///< Content-Security-Policy, or empty
};

/// Makes the answer for a path anew; calls `done` later, on the server's thread.
using MakeResource = std::function<void(std::function<void(const Resource&)> done)>;

/// Limits of one server for its clients.
struct ServerLimits {
  std::size_t connections =
      256;  ///< at a time, HTTP and WebSocket; then a new one replaces another
  std::size_t connections_per_address = 128;  ///< without operators (README.md)
  std::size_t request_bytes = 8 * 1024;       ///< header of an HTTP request; bodies are refused
  std::size_t message_bytes = 64 * 1024;      ///< of a WebSocket message from a client
  std::size_t queue_bytes = 8 << 20;          ///< of one connection
  std::size_t all_queues_bytes = 16 << 20;
  double request_timeout_s = 10;  ///< for a whole request, and for the next one
  double silence_timeout_s = 30;  ///< without an answer to a ping
};

struct ServerOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8765;  ///< 0: any free port
  AccessOptions access;
  ServerLimits limits;
};

class Server {
 public:
  /// Listens on `options.address`; `options.access.address` is ignored. @throws config::ConfigError
  /// "--port: …" if the port is in use, "--listen: …" if the address is none of this machine, or
  /// needs a token (`check` of access.hpp).
  explicit Server(const ServerOptions& options);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;
  /// "http://127.0.0.1:8765/".
  std::string url() const;

  /// Call these before `run`. `path` begins with a slash.
  void add_resource(const std::string& path, Resource resource);
  void add_resource(const std::string& path, MakeResource make);
  void add_protocol(Protocol protocol);

  /// Makes the server's thread call `task`. May be called from any thread.
  void post(std::function<void()> task);
  /// Calls `task` on the server's thread every `period_s`.
  void repeat(double period_s, std::function<void()> task);

  /// Serves until `stop`. No session outlives it.
  void run();
  /// Closes all connections (1001) and ends `run`. May be called from any thread.
  void stop();

  /// Number of open WebSocket connections.
  std::size_t count_connections() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sls::view
