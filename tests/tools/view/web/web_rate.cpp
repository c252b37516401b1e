/// Measures messages to one client on loopback: `view_web_rate [SECONDS]` prints two lines, one for
/// 50,000 messages a second, one for the largest rate; 700 bytes each, posted from another thread.
#include <pthread.h>
#include <time.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>

#include "tests/tools/view/web/running_server.hpp"
#include "tests/tools/view/web/web_client.hpp"

namespace {

using namespace sls;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMessageBytes = 700;
constexpr std::size_t kFrameBytes = kMessageBytes + 4;
constexpr std::size_t kMostQueued = 4 << 20;
constexpr double kRate = 50'000;

class Silent : public view::Session {
 public:
  void receive(view::MessageKind, std::string_view) override {}
};

double calc_seconds(Clock::duration time) { return std::chrono::duration<double>(time).count(); }

double calc_thread_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Posts messages until `deadline`: `rate` a second, or with `rate` 0 while the queue has room.
std::uint64_t post_messages(test::RunningServer& server, view::Connection& connection, double rate,
                            Clock::time_point deadline) {
  const auto payload = std::make_shared<const std::string>(kMessageBytes, 'x');
  const auto begin = Clock::now();
  std::uint64_t posted = 0;
  while (Clock::now() < deadline) {
    const bool is_early =
        rate > 0 && static_cast<double>(posted) > rate * calc_seconds(Clock::now() - begin);
    if (is_early || (posted % 1024 == 0 &&
                     server.ask([&] { return connection.queued_bytes(); }) > kMostQueued)) {
      std::this_thread::sleep_for(std::chrono::microseconds(100));
      continue;
    }
    server->post([&connection, payload] {
      connection.send(view::MessageKind::kBinary, payload, view::Delivery::kAlways);
    });
    ++posted;
  }
  return posted;
}

void measure(const char* name, double rate, double seconds) {
  view::Connection* connection = nullptr;
  test::RunningServer server(test::make_options(), [&](view::Server& prepared) {
    prepared.add_protocol({{"rate"}, [&connection](view::Connection& opened) {
                             connection = &opened;
                             return std::make_unique<Silent>();
                           }});
  });
  test::RawClient client = test::open_websocket(server.port(), "rate");
  while (server.ask([&] { return connection == nullptr; })) {
  }
  std::atomic<std::uint64_t> read_bytes{0};
  std::thread reader([&] {
    std::string bytes(1 << 18, '\0');
    for (;;) {
      const ssize_t count = ::recv(client.socket(), bytes.data(), bytes.size(), 0);
      if (count <= 0) return;
      read_bytes += static_cast<std::uint64_t>(count);
    }
  });
  const double cpu_before = server.ask(calc_thread_seconds);
  const auto begin = Clock::now();
  const std::uint64_t posted = post_messages(
      server, *connection, rate,
      begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds)));
  while (read_bytes < posted * kFrameBytes) std::this_thread::yield();
  const double taken = calc_seconds(Clock::now() - begin);
  const double cpu = server.ask(calc_thread_seconds) - cpu_before;
  std::printf("%s: %.0f messages/s, server thread %.2f of a core\n", name,
              static_cast<double>(posted) / taken, cpu / taken);
  server.stop();
  reader.join();
}

}  // namespace

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 3;
  measure("paced", kRate, seconds);
  measure("as fast as possible", 0, seconds);
  return 0;
}
