#include "tools/doctor/udp_socket.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <memory>
#include <system_error>

namespace sls::doctor {
namespace {

const sockaddr* as_generic(const sockaddr_in& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

}  // namespace

sockaddr_in make_address(const std::string& address, int port) {
  sockaddr_in made{};
  made.sin_family = AF_INET;
  made.sin_port = htons(static_cast<std::uint16_t>(port));
  ::inet_pton(AF_INET, address.c_str(), &made.sin_addr);
  return made;
}

std::string to_string(const in_addr& address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET, &address, text.data(), text.size());
  return text.data();
}

std::optional<std::string> find_address(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), nullptr, &hints, &found) != 0) return std::nullopt;
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
  return to_string(reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr);
}

std::vector<Interface> find_interfaces() {
  std::vector<Interface> found;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return found;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, &::freeifaddrs);
  for (const ifaddrs* entry = list; entry; entry = entry->ifa_next) {
    if (!entry->ifa_addr || entry->ifa_addr->sa_family != AF_INET) continue;
    if (!(entry->ifa_flags & IFF_UP)) continue;
    found.push_back({to_string(reinterpret_cast<const sockaddr_in*>(entry->ifa_addr)->sin_addr),
                     (entry->ifa_flags & IFF_LOOPBACK) != 0});
  }
  return found;
}

bool is_own_address(const std::string& address) {
  if (address.rfind("127.", 0) == 0) return true;
  const auto interfaces = find_interfaces();
  return std::any_of(interfaces.begin(), interfaces.end(),
                     [&](const Interface& interface) { return interface.address == address; });
}

UdpSocket::UdpSocket()
    : descriptor_(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
  if (descriptor_ < 0) throw std::system_error(errno, std::generic_category(), "socket");
}

UdpSocket::~UdpSocket() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

bool UdpSocket::bind(const std::string& address, int port, bool is_shared) {
  const int yes = 1;
  if (is_shared) ::setsockopt(descriptor_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const sockaddr_in own = make_address(address, port);
  return ::bind(descriptor_, as_generic(own), sizeof own) == 0;
}

void UdpSocket::join(const std::string& group, const std::vector<Interface>& interfaces) {
  for (const Interface& interface : interfaces) {
    ip_mreq request{};
    ::inet_pton(AF_INET, group.c_str(), &request.imr_multiaddr);
    ::inet_pton(AF_INET, interface.address.c_str(), &request.imr_interface);
    ::setsockopt(descriptor_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &request, sizeof request);
  }
}

void UdpSocket::send_multicast_by(const std::string& interface_address) {
  in_addr interface {};
  ::inet_pton(AF_INET, interface_address.c_str(), &interface);
  ::setsockopt(descriptor_, IPPROTO_IP, IP_MULTICAST_IF, &interface, sizeof interface);
}

bool UdpSocket::connect(const sockaddr_in& peer) {
  return ::connect(descriptor_, as_generic(peer), sizeof peer) == 0;
}

std::string UdpSocket::find_own_address() const {
  sockaddr_in own{};
  socklen_t size = sizeof own;
  ::getsockname(descriptor_, reinterpret_cast<sockaddr*>(&own), &size);
  return to_string(own.sin_addr);
}

int UdpSocket::send(const void* data, std::size_t size) {
  return ::send(descriptor_, data, size, MSG_NOSIGNAL) < 0 ? errno : 0;
}

int UdpSocket::send_to(const sockaddr_in& peer, const void* data, std::size_t size) {
  return ::sendto(descriptor_, data, size, MSG_NOSIGNAL, as_generic(peer), sizeof peer) < 0 ? errno
                                                                                            : 0;
}

std::optional<UdpSocket::Received> UdpSocket::receive(std::vector<unsigned char>& buffer,
                                                      int* error) {
  buffer.resize(kMaxDatagram);
  Received received;
  socklen_t size = sizeof received.sender;
  const ssize_t count = ::recvfrom(descriptor_, buffer.data(), buffer.size(), 0,
                                   reinterpret_cast<sockaddr*>(&received.sender), &size);
  if (error) *error = count < 0 && errno != EAGAIN ? errno : 0;
  if (count < 0) return std::nullopt;
  received.size = static_cast<std::size_t>(count);
  return received;
}

}  // namespace sls::doctor
