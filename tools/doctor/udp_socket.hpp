/// UDP socket for the probes: IPv4, non-blocking, closed by its destructor.
#pragma once

#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace sls::doctor {

/// The group in which participants announce themselves.
inline constexpr const char* kMulticastGroup = "239.255.0.1";

/// Largest UDP datagram, bytes.
inline constexpr std::size_t kMaxDatagram = 65507;

sockaddr_in make_address(const std::string& address, int port);
std::string to_string(const in_addr& address);

/// The IPv4 address of `host`, a name or an address; nothing if it has none.
std::optional<std::string> find_address(const std::string& host);

struct Interface {
  std::string address;
  bool is_loopback = false;
};
/// Interfaces that are up and have an IPv4 address.
std::vector<Interface> find_interfaces();

/// True for an address of this host.
bool is_own_address(const std::string& address);

class UdpSocket {
 public:
  UdpSocket();
  ~UdpSocket();
  UdpSocket(UdpSocket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  /// False if the port is taken.
  bool bind(const std::string& address, int port, bool is_shared = false);
  void join(const std::string& group, const std::vector<Interface>& interfaces);
  /// Multicast datagrams leave by the interface with this address.
  void send_multicast_by(const std::string& interface_address);
  bool connect(const sockaddr_in& peer);
  /// Local address of the connected socket.
  std::string find_own_address() const;

  /// Returns 0 or errno. A later call reports the error of an earlier datagram (port closed).
  int send(const void* data, std::size_t size);
  int send_to(const sockaddr_in& peer, const void* data, std::size_t size);

  struct Received {
    std::size_t size = 0;
    sockaddr_in sender{};
  };
  /// A datagram if one has arrived; `error` is set to errno, or 0.
  std::optional<Received> receive(std::vector<unsigned char>& buffer, int* error = nullptr);

  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

}  // namespace sls::doctor
