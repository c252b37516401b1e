/// Any bytes from a client are answered or refused, and the connection ends after the last one. An
/// input is a mode (1 byte) and bytes. In mode 0 they are HTTP requests; in mode N they are frames
/// after an upgrade to subprotocol N - 1 (modulo their count). A mask of zeros keeps a payload
/// readable.
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>

#include "tests/tools/view/web/sessions.hpp"
#include "tools/view/web/hub.hpp"

namespace {

using namespace sls;

constexpr std::chrono::milliseconds kPatience(10);

/// Sends each message back; its first byte selects delivery and key.
class Mirror : public view::Session {
 public:
  explicit Mirror(view::Connection& connection) : connection_(connection) {}
  void receive(view::MessageKind kind, std::string_view message) override {
    const auto manner = message.empty() ? 0u : static_cast<std::uint8_t>(message.front());
    connection_.send(kind, test::make_payload(std::string(message)),
                     static_cast<view::Delivery>(manner % 3), manner / 3);
    connection_.queued_bytes();
  }

 private:
  view::Connection& connection_;
};

/// The protocols that need no network. A new one is added here.
void add_protocols(view::Hub& hub) {
  hub.protocols.push_back(test::make_echo({"echo"}));
  hub.protocols.push_back({{"mirror"}, [](view::Connection& connection) {
                             return std::make_unique<Mirror>(connection);
                           }});
}

std::unique_ptr<view::Hub> make_hub() {
  view::AccessOptions access;
  access.token = "0123456789abcdef";
  access.allowed_origins = {"https://allowed.org"};
  view::ServerLimits limits;
  limits.request_bytes = 2'048;
  limits.message_bytes = 4'096;
  limits.queue_bytes = 16'384;
  auto hub = std::make_unique<view::Hub>(access, limits);
  const view::Resource page{"text/html", test::make_payload("the page"),
                            test::make_payload("zipped"), "default-src *"};
  hub->resources["/"] = [page](const auto& done) { done(page); };
  add_protocols(*hub);
  return hub;
}

/// The client's end of a socket pair. The hub serves the other end.
class Peer {
 public:
  explicit Peer(view::Hub& hub) : hub_(hub) {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) std::abort();
    socket_ = ends[0];
    view::Socket served(hub.io.get_executor());
    served.assign(view::Tcp::v4(), ends[1]);
    hub.adopt(std::move(served));
  }
  ~Peer() { ::close(socket_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  void send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent > 0) bytes.remove_prefix(static_cast<std::size_t>(sent));
      if (sent <= 0 && errno != EAGAIN) return;
      work();
    }
  }
  void send_end() {
    ::shutdown(socket_, SHUT_WR);
    while (hub_.count_clients() > 0) {
      work();
      if (hub_.count_clients() > 0) hub_.io.run_one_for(kPatience);
    }
  }

 private:
  /// Runs the hub and reads its output.
  void work() {
    hub_.io.restart();
    hub_.io.poll();
    char bytes[65536];
    while (::recv(socket_, bytes, sizeof(bytes), MSG_DONTWAIT) > 0) {
    }
  }
  view::Hub& hub_;
  int socket_;
};

std::string make_upgrade(const view::Hub& hub, std::size_t protocol) {
  return "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: upgrade\r\nUpgrade: websocket\r\n"
         "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
         "Sec-WebSocket-Protocol: " +
         hub.protocols[protocol % hub.protocols.size()].names.front() + "\r\n\r\n";
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::unique_ptr<view::Hub> hub = make_hub();
  if (size == 0) return 0;
  Peer peer(*hub);
  if (data[0] > 0) {
    peer.send(make_upgrade(*hub, data[0] - 1u));
    if (hub->websockets != 1) std::abort();
  }
  peer.send({reinterpret_cast<const char*>(data + 1), size - 1});
  peer.send_end();
  if (hub->websockets != 0) std::abort();
  return 0;
}
