/// A wire with faults: forwards Ethernet frames between two interfaces in both directions, each
/// after a delay, some twice. It replaces netem, which this kernel lacks. At SIGTERM it prints its
/// counts and ends.
#include <arpa/inet.h>
#include <linux/if_packet.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <queue>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

volatile sig_atomic_t stop = 0;

struct Faults {
  double delay_ms = 0.0;
  double jitter_ms = 0.0;  // largest extra delay, uniform; frames overtake each other
  double duplicate_percent = 0.0;
  std::uint64_t seed = 1;
};

struct Frame {
  Clock::time_point due;
  std::uint64_t number = 0;  // in the order of arrival
  int to = -1;               // socket
  std::vector<char> bytes;   // with the header for incomplete checksums
};

struct IsLater {
  bool operator()(const Frame& a, const Frame& b) const {
    return a.due != b.due ? a.due > b.due : a.number > b.number;
  }
};

int open_interface(const std::string& name) {
  const int socket = ::socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, htons(ETH_P_ALL));
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(ETH_P_ALL);
  address.sll_ifindex = static_cast<int>(if_nametoindex(name.c_str()));
  const int yes = 1, buffer = 1 << 22;
  packet_mreq promiscuous{};
  promiscuous.mr_ifindex = address.sll_ifindex;
  promiscuous.mr_type = PACKET_MR_PROMISC;
  const auto set = [socket](int option, const auto& value) {
    return setsockopt(socket, SOL_PACKET, option, &value, sizeof value) == 0;
  };
  // Between veth ends checksums are incomplete; the header makes the kernel complete them.
  const bool is_open = socket >= 0 && set(PACKET_VNET_HDR, yes) &&
                       set(PACKET_IGNORE_OUTGOING, yes) &&
                       set(PACKET_ADD_MEMBERSHIP, promiscuous) &&
                       bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  if (!is_open) throw std::runtime_error(name + ": cannot open");
  setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &buffer, sizeof buffer);
  setsockopt(socket, SOL_SOCKET, SO_SNDBUFFORCE, &buffer, sizeof buffer);
  return socket;
}

class Relay {
 public:
  Relay(const std::string& a, const std::string& b, const Faults& faults)
      : faults_(faults), generator_(faults.seed), ends_{open_interface(a), open_interface(b)} {}
  ~Relay() {
    for (const int end : ends_) close(end);
  }

  void run() {
    while (!stop) {
      pollfd ready[] = {{ends_[0], POLLIN, 0}, {ends_[1], POLLIN, 0}};
      const auto wait = calc_wait();
      if (ppoll(ready, 2, &wait, nullptr) > 0)
        for (int i = 0; i < 2; ++i)
          if (ready[i].revents & POLLIN) receive(ends_[i], ends_[1 - i]);
      send_what_is_due();
    }
    std::printf("frame_relay: %llu frames, %llu duplicated, %llu overtaken, %llu lost\n", count_,
                duplicated_, overtaken_, lost_);
  }

 private:
  timespec calc_wait() const {
    constexpr std::chrono::nanoseconds kLongest = std::chrono::milliseconds(100);
    auto wait = kLongest;
    if (!queue_.empty())
      wait = std::clamp<std::chrono::nanoseconds>(queue_.top().due - Clock::now(),
                                                  std::chrono::nanoseconds(0), kLongest);
    return {0, static_cast<long>(wait.count())};
  }

  void receive(int from, int to) {
    constexpr std::size_t kMostQueued = 20000;  // beyond it frames are lost, as in a switch
    std::vector<char> bytes(70000);
    const ssize_t size = recv(from, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (size <= 0) return;
    bytes.resize(static_cast<std::size_t>(size));
    ++count_;
    const bool is_twice = unit_(generator_) * 100 < faults_.duplicate_percent;
    duplicated_ += is_twice;
    for (int copy = 0; copy <= static_cast<int>(is_twice); ++copy) {
      if (queue_.size() >= kMostQueued) {
        ++lost_;
        continue;
      }
      const std::chrono::duration<double, std::milli> delay(faults_.delay_ms +
                                                            unit_(generator_) * faults_.jitter_ms);
      queue_.push(
          {Clock::now() + std::chrono::duration_cast<Clock::duration>(delay), count_, to, bytes});
    }
  }

  void send_what_is_due() {
    while (!queue_.empty() && queue_.top().due <= Clock::now()) {
      const Frame& frame = queue_.top();
      auto& last = last_sent_[frame.to == ends_[0] ? 0 : 1];
      if (frame.number < last) ++overtaken_;
      last = std::max<unsigned long long>(last, frame.number);
      if (send(frame.to, frame.bytes.data(), frame.bytes.size(), 0) < 0) ++lost_;
      queue_.pop();
    }
  }

  const Faults faults_;
  std::mt19937_64 generator_;
  std::uniform_real_distribution<double> unit_;
  const int ends_[2];
  std::priority_queue<Frame, std::vector<Frame>, IsLater> queue_;
  unsigned long long count_ = 0, duplicated_ = 0, overtaken_ = 0, lost_ = 0;
  unsigned long long last_sent_[2] = {0, 0};
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App cli("Forwards Ethernet frames between two interfaces, with delay and duplicates.");
  std::string a, b;
  Faults faults;
  cli.add_option("A", a, "interface")->required();
  cli.add_option("B", b, "interface")->required();
  cli.add_option("--delay-ms", faults.delay_ms, "of every frame")->check(CLI::Range(0.0, 1000.0));
  cli.add_option("--jitter-ms", faults.jitter_ms, "up to so much more")
      ->check(CLI::Range(0.0, 1000.0));
  cli.add_option("--duplicate-percent", faults.duplicate_percent, "frames that come twice")
      ->check(CLI::Range(0.0, 100.0));
  cli.add_option("--seed", faults.seed, "decides jitter and duplicates");
  CLI11_PARSE(cli, argc, argv);
  prctl(PR_SET_PDEATHSIG, SIGTERM);  // ends with the test
  signal(SIGTERM, [](int) { stop = 1; });
  try {
    Relay(a, b, faults).run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "frame_relay: %s\n", error.what());
    return 1;
  }
  return 0;
}
