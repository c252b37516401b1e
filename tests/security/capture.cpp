/// capture FILE: writes every packet on the interfaces of this network namespace to FILE, until
/// SIGTERM or 256 MB.
#include <arpa/inet.h>
#include <linux/if_ether.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <fstream>

namespace {

volatile sig_atomic_t is_over = 0;

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  struct sigaction action = {};
  action.sa_handler = [](int) { is_over = 1; };  // without SA_RESTART: recv returns
  sigaction(SIGTERM, &action, nullptr);
  const int packets = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, htons(ETH_P_ALL));
  const int buffer_size = 32 << 20;
  if (packets < 0 ||
      setsockopt(packets, SOL_SOCKET, SO_RCVBUFFORCE, &buffer_size, sizeof buffer_size) != 0) {
    std::perror("capture");
    return 1;
  }
  std::ofstream file(argv[1], std::ios::binary);
  std::puts("capturing");
  std::fflush(stdout);
  std::array<char, 65536> packet;
  for (std::size_t total = 0; !is_over && total < (256u << 20);) {
    const ssize_t size = recv(packets, packet.data(), packet.size(), 0);
    if (size <= 0) continue;
    file.write(packet.data(), size);
    total += static_cast<std::size_t>(size);
  }
  return file.flush() ? 0 : 1;
}
