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
#include <utility>
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

/// Sends to every port on which the first participant of each host in the domain listens.
class Gun {
 public:
  explicit Gun(const Target& target) : target_(target), socket_(AF_INET, SOCK_DGRAM, 0) {}

  void fire(const Bytes& packet) {
    const int base = 7400 + 250 * target_.domain;
    send("239.255.0.1", base, packet);
    for (const std::string& address : target_.addresses)
      for (const int port : {base + 1, base + 10, base + 11}) send(address, port, packet);
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

void replace_all(Bytes& packet, const Bytes& old, const Bytes& by) {
  for (auto at = packet.begin();;) {
    at = std::search(at, packet.end(), old.begin(), old.end());
    if (at == packet.end()) return;
    at = std::copy(by.begin(), by.end(), at);
  }
}

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

/// A part of an RTPS message.
struct Submessage {
  std::uint8_t kind = 0, flags = 1;  // little-endian
  Bytes content;
};

/// Changes captured messages in what RTPS says of them: kinds, flags, lengths, identifiers,
/// numbers, parameters, order. Equal seeds make equal messages.
class Mutator {
 public:
  Mutator(std::vector<Bytes> packets, std::uint64_t seed)
      : packets_(std::move(packets)), random_(seed) {}

  /// The next message, from `from` or, by default, from any one.
  Bytes make(const Bytes* from = nullptr) {
    const Bytes& packet = from ? *from : pick(packets_);
    auto parts = split(packet);
    for (auto changes = random_() % 4; changes > 0 && !parts.empty(); --changes) change(parts);
    Bytes result(packet.begin(), packet.begin() + kRtpsHeader);
    for (const Submessage& part : parts) {
      std::size_t length = part.content.size();
      if (random_() % 32 == 0) length = make_number();
      for (const std::size_t byte :
           {std::size_t{part.kind}, std::size_t{part.flags}, part.flags & 1 ? length : length >> 8,
            part.flags & 1 ? length >> 8 : length})
        result.push_back(static_cast<std::uint8_t>(byte));
      result.insert(result.end(), part.content.begin(), part.content.end());
    }
    if (random_() % 16 == 0) result.resize(random_() % (result.size() + 1));
    result.resize(std::min<std::size_t>(result.size(), 60'000));
    return result;
  }
  std::uint64_t random() { return random_(); }

 private:
  template <class List>
  auto pick(List& list) -> decltype(list[0]) {
    return list[random_() % list.size()];
  }

  static std::vector<Submessage> split(const Bytes& packet) {
    std::vector<Submessage> parts;
    for (std::size_t at = kRtpsHeader; at + 4 <= packet.size();) {
      const bool is_little = packet[at + 1] & 1;
      std::size_t length = packet[at + (is_little ? 3 : 2)] << 8 | packet[at + (is_little ? 2 : 3)];
      if (length == 0) length = packet.size() - at - 4;
      length = std::min(length, packet.size() - at - 4);
      const auto begin = packet.begin() + static_cast<std::ptrdiff_t>(at) + 4;
      parts.push_back(
          {packet[at], packet[at + 1], Bytes(begin, begin + static_cast<std::ptrdiff_t>(length))});
      at += 4 + length;
    }
    return parts;
  }

  std::uint64_t make_number() {
    const std::array<std::uint64_t, 12> telling = {
        0, 1, 2, 4, 0xff, 0x7fff, 0x8000, 0xffff, 0x10000, 0x7fffffff, 0x80000000, 0xffffffff};
    return random_() % 3 ? pick(telling) : random_() % 512;
  }

  /// A part of any kind, also of those that a flight does not send.
  Submessage invent() {
    Submessage part{static_cast<std::uint8_t>(random_() % 4 ? random_() % 0x35 : 0x80),
                    static_cast<std::uint8_t>(random_() % 16 | (random_() % 8 != 0)),
                    Bytes(random_() % 20 * 4)};
    const auto known = split(pick(packets_));
    if (!known.empty()) {  // begins with identifiers that exist
      const Bytes& like = known[random_() % known.size()].content;
      std::copy_n(like.begin(), std::min(like.size(), part.content.size()), part.content.begin());
    }
    return part;
  }

  void change(std::vector<Submessage>& parts) {
    Submessage& part = pick(parts);
    Bytes& content = part.content;
    switch (random_() % 12) {
      case 0:
        part.flags ^= static_cast<std::uint8_t>(1 << random_() % 8);
        break;
      case 1:
        part.kind = invent().kind;
        break;
      case 2:
        content.resize(random_() % (content.size() + 1));
        break;
      case 3:
        for (auto left = random_() % 64; left > 0; --left)
          content.push_back(static_cast<std::uint8_t>(random_()));
        break;
      case 4:
        std::swap(part, pick(parts));
        break;
      case 5:
        parts.insert(parts.begin() + static_cast<std::ptrdiff_t>(random_() % parts.size()),
                     random_() % 2 ? invent() : Submessage(part));
        break;
      case 6: {  // the rest of another message
        const auto others = split(pick(packets_));
        parts.resize(1 + random_() % parts.size());
        parts.insert(parts.end(), others.begin(), others.end());
        break;
      }
      default: {  // a number of 1, 2, 4 or 8 bytes, mostly in its place
        const std::size_t bytes = std::size_t{1} << random_() % 4;
        std::size_t at = random_() % std::min<std::size_t>(content.size() + 1, 64);
        if (random_() % 4 == 0) at = random_() % (content.size() + 1);
        at = at / bytes * bytes;
        const std::uint64_t number = make_number();
        for (std::size_t i = 0; i < bytes && at + i < content.size(); ++i)
          content[at + i] = static_cast<std::uint8_t>(number >> 8 * (i % 8));
      }
    }
  }

  const std::vector<Bytes> packets_;
  std::mt19937_64 random_;
};

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
  Mutator mutator(read_captured(captured), target.seed);
  std::mt19937_64 random(target.seed);
  Gun gun(target);
  while (goes_on(target)) gun.fire(random() % 4 ? mutator.make() : make_random_bytes(random));
  return gun.fired();
}

std::uint64_t fire_mutations(const Target& target, const std::filesystem::path& captured,
                             std::uint64_t most) {
  std::vector<Bytes> packets = read_captured(captured);
  for (Bytes& packet : packets) {
    const Bytes sender(packet.begin() + kPrefixAt, packet.begin() + kRtpsHeader);
    Bytes stranger = sender;
    for (std::size_t i = 4; i < stranger.size(); ++i) stranger[i] ^= 0x55;
    replace_all(packet, sender, stranger);
  }
  Mutator mutator(packets, target.seed);
  Gun gun(target);
  while (goes_on(target) && gun.fired() < most) gun.fire(mutator.make());
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
    replace_all(packet, known, prefix);
    gun.fire(packet);
  }
  return gun.fired();
}

std::uint64_t spoof(const Target& target) {
  Sniffer sniffer;
  std::vector<Bytes> packets;
  while (goes_on(target) && packets.size() < kMaxCaptured / 4)
    if (Bytes packet = sniffer.next(); !packet.empty()) packets.push_back(packet);
  if (packets.empty()) return 0;
  Mutator mutator(packets, target.seed);
  Gun gun(target);
  while (goes_on(target)) {
    Bytes packet = sniffer.next();  // its own, too
    if (packet.empty() || mutator.random() % 8) continue;
    gun.fire(mutator.make(&packet));
  }
  return gun.fired();
}

}  // namespace sls::hostile
