/// Clients of the web tests: raw sockets, which share no code with the server.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace sls::test {

inline constexpr const char* kKey = "dGhlIHNhbXBsZSBub25jZQ==";  ///< from RFC 6455, section 1.3

/// A frame as a client must send it; a mask of zeros leaves the payload readable.
struct Frame {
  int opcode = 1;
  std::string payload;
  bool is_final = true;
  int reserved = 0;  ///< The three reserved bits.
  bool is_masked = true;
  std::optional<std::uint64_t> declared_size = std::nullopt;  ///< A wrong size on purpose.
};

inline constexpr int kText = 1;
inline constexpr int kBinary = 2;
inline constexpr int kClose = 8;
inline constexpr int kPing = 9;
inline constexpr int kPong = 10;

inline std::string to_bytes(const Frame& frame) {
  std::string bytes;
  bytes += static_cast<char>((frame.is_final ? 0x80 : 0) | frame.reserved << 4 | frame.opcode);
  const std::uint64_t size = frame.declared_size.value_or(frame.payload.size());
  const int mask = frame.is_masked ? 0x80 : 0;
  const int size_bytes = size < 126 ? 0 : size < 65536 ? 2 : 8;
  bytes += static_cast<char>(mask | (size_bytes == 0 ? size : size_bytes == 2 ? 126 : 127));
  for (int i = size_bytes - 1; i >= 0; --i) bytes += static_cast<char>(size >> (8 * i));
  if (frame.is_masked) bytes += std::string(4, '\0');
  return bytes + frame.payload;
}

/// A TCP connection to 127.0.0.1; every call has a deadline.
class RawClient {
 public:
  explicit RawClient(std::uint16_t port)
      : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0)
      throw std::runtime_error("connect failed");
  }
  ~RawClient() {
    if (socket_ >= 0) ::close(socket_);
  }
  RawClient(RawClient&& other) noexcept
      : socket_(std::exchange(other.socket_, -1)), input_(std::move(other.input_)) {}
  RawClient& operator=(RawClient&&) = delete;

  int socket() const { return socket_; }

  /// False if the server has closed the connection.
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }

  /// Reads `count` bytes, or fewer if the connection ends first.
  std::string read(std::size_t count) {
    while (input_.size() < count && read_some()) {
    }
    return take(std::min(count, input_.size()));
  }

  /// Reads up to and including `end`, or all bytes if the connection ends first.
  std::string read_until(std::string_view end) {
    std::size_t place;
    while ((place = input_.find(end)) == std::string::npos)
      if (!read_some()) return take(input_.size());
    return take(place + end.size());
  }

  std::string read_all() {
    while (read_some()) {
    }
    return take(input_.size());
  }

  /// The header of an answer, and its body by Content-Length.
  std::pair<std::string, std::string> read_answer() {
    std::string header = read_until("\r\n\r\n");
    const std::string name = "Content-Length: ";
    const auto place = header.find(name);
    if (place == std::string::npos) return {header, ""};
    std::string body = read(std::stoul(header.substr(place + name.size())));
    return {std::move(header), std::move(body)};
  }

  /// The next frame; opcode -1 if the connection ended.
  Frame read_frame() {
    Frame frame;
    frame.opcode = -1;
    const std::string head = read(2);
    if (head.size() < 2) return frame;
    const auto at = [](const std::string& bytes, std::size_t i) {
      return static_cast<std::uint8_t>(bytes.at(i));
    };
    std::uint64_t size = at(head, 1) & 0x7f;
    frame.is_masked = (at(head, 1) & 0x80) != 0;
    const std::size_t size_bytes = size == 126 ? 2 : size == 127 ? 8 : 0;
    if (size_bytes > 0) {
      size = 0;
      const std::string longer = read(size_bytes);
      for (std::size_t i = 0; i < longer.size(); ++i) size = size << 8 | at(longer, i);
    }
    frame.payload = read(size);
    if (frame.payload.size() < size) return frame;
    frame.opcode = at(head, 0) & 0x0f;
    frame.reserved = (at(head, 0) >> 4) & 7;
    frame.is_final = (at(head, 0) & 0x80) != 0;
    return frame;
  }

  /// Reads until a close frame. @returns its code; 0 if the connection ends without one.
  int read_close_code() {
    for (;;) {
      const Frame frame = read_frame();
      if (frame.opcode == -1) return 0;
      if (frame.opcode != kClose) continue;
      if (frame.payload.size() < 2) return 1005;
      return static_cast<std::uint8_t>(frame.payload[0]) << 8 |
             static_cast<std::uint8_t>(frame.payload[1]);
    }
  }

  /// True if the connection ends within the deadline.
  bool ends() {
    while (read_some()) {
    }
    return has_ended_;
  }

 private:
  static constexpr int kDeadlineMs = 60'000;

  bool read_some() {
    pollfd waiting{socket_, POLLIN, 0};
    if (::poll(&waiting, 1, kDeadlineMs) != 1) return false;
    char bytes[65536];
    const ssize_t count = ::recv(socket_, bytes, sizeof(bytes), 0);
    has_ended_ = count <= 0;
    if (has_ended_) return false;
    input_.append(bytes, static_cast<std::size_t>(count));
    return true;
  }

  std::string take(std::size_t count) {
    std::string taken = input_.substr(0, count);
    input_.erase(0, count);
    return taken;
  }

  int socket_;
  std::string input_;
  bool has_ended_ = false;
};

inline std::string make_get(const std::string& target, std::uint16_t port,
                            const std::string& fields = "") {
  return "GET " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n" +
         fields + "\r\n";
}

inline std::string make_upgrade(std::uint16_t port, const std::string& subprotocols,
                                const std::string& target = "/", const std::string& fields = "") {
  return make_get(target, port,
                  "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                  "Sec-WebSocket-Key: " +
                      std::string(kKey) + "\r\nSec-WebSocket-Protocol: " + subprotocols + "\r\n" +
                      fields);
}

/// A client that has a WebSocket of `subprotocol`.
inline RawClient open_websocket(std::uint16_t port, const std::string& subprotocol,
                                const std::string& target = "/") {
  RawClient client(port);
  client.send(make_upgrade(port, subprotocol, target));
  const std::string header = client.read_until("\r\n\r\n");
  if (header.rfind("HTTP/1.1 101", 0) != 0) throw std::runtime_error("no WebSocket: " + header);
  return client;
}

}  // namespace sls::test
