/// Clients that do not read, thousands of connections, and floods: their effect on other clients.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <time.h>

#include <atomic>
#include <filesystem>
#include <map>

#include "tests/support/waiting.hpp"
#include "tests/tools/view/web/running_server.hpp"
#include "tests/tools/view/web/sessions.hpp"
#include "tests/tools/view/web/web_client.hpp"

namespace sls::view {
namespace {

using test::kBinary;
using test::kPing;
using test::kText;
using test::RawClient;
using test::RunningServer;
using test::to_bytes;

constexpr std::size_t kMessageBytes = 1'000;

/// Bytes that the server may hold beside a queue: gathered ones and those in the system call.
constexpr std::size_t kMostGathered = 2 * 32 * 1024;

std::string make_message(std::uint32_t number) {
  std::string text = std::to_string(number);
  return text + std::string(kMessageBytes - text.size(), ' ');
}

/// Two clients; the first does not read.
class StalledReaderTest : public testing::Test {
 protected:
  StalledReaderTest()
      : server_(make_options(),
                [this](Server& server) { server.add_protocol(test::make_listed(connections_)); }) {}
  ~StalledReaderTest() override { server_.stop(); }

  static ServerOptions make_options() {
    ServerOptions options = test::make_options();
    options.limits.queue_bytes = 1 << 20;
    return options;
  }

  /// Sends each message to both, as fast as the second one reads. Keeps the largest number of bytes
  /// queued for the first.
  void send_to_both(std::uint32_t count, Delivery delivery, std::uint32_t keys) {
    for (std::uint32_t number = 0; number < count;) {
      const bool has_room = server_.ask([&] {
        most_queued_ = std::max(most_queued_, connections_.at(0)->queued_bytes());
        if (connections_.at(1)->queued_bytes() > (1 << 18)) return false;
        for (int i = 0; i < 100 && number < count; ++i, ++number)
          for (Connection* connection : connections_)
            connection->send(MessageKind::kBinary, test::make_payload(make_message(number)),
                             connection == connections_[0] ? delivery : Delivery::kAlways,
                             number % keys);
        return true;
      });
      if (!has_room) std::this_thread::yield();
    }
  }

  /// Reads `count` messages of the second client and checks that none is missing.
  std::thread read_all(std::uint32_t count) {
    return std::thread([this, count] {
      for (std::uint32_t number = 0; number < count; ++number)
        ASSERT_EQ(clients_.at(1).read_frame().payload, make_message(number));
    });
  }

  void open_clients() {
    for (std::size_t i = 1; i <= 2; ++i) {
      clients_.push_back(test::open_websocket(server_.port(), "listed"));
      ASSERT_TRUE(
          test::wait_until([&] { return server_.ask([&] { return connections_.size() == i; }); }));
    }
  }

  static constexpr std::uint32_t kMessages = 30'000;  // 30 MB, more than the socket buffers
  test::Listed::List connections_;
  RunningServer server_;
  std::vector<RawClient> clients_;
  std::size_t most_queued_ = 0;
};

TEST_F(StalledReaderTest, GetsTheNewestOfEachKeyOrTheNewestThatFit) {
  constexpr std::uint32_t kKeys = 4;
  for (const auto& [delivery, most] :
       {std::pair(Delivery::kNewest, (kKeys + 1) * kMessageBytes),
        std::pair(Delivery::kDroppable, make_options().limits.queue_bytes + kMessageBytes)}) {
    open_clients();
    std::thread reader = read_all(kMessages);
    send_to_both(kMessages, delivery, kKeys);
    reader.join();
    EXPECT_LE(most_queued_, kMostGathered + most);
    const std::uint64_t dropped = server_.ask([&] { return connections_[0]->dropped(); });
    EXPECT_GT(dropped, 0u);
    // Now the first reads: the messages of the socket buffers, then the queued ones.
    std::map<std::uint32_t, std::uint32_t> newest;  // of each key
    for (std::uint64_t read = 0; read < kMessages - dropped; ++read) {
      const auto number = static_cast<std::uint32_t>(std::stoul(clients_[0].read_frame().payload));
      const auto [place, is_first] = newest.try_emplace(number % kKeys, number);
      ASSERT_TRUE(is_first || place->second < number) << "each key in order";
      place->second = number;
    }
    for (const auto& [key, number] : newest) EXPECT_GE(number, kMessages - kKeys);
    EXPECT_EQ(newest.size(), kKeys);
    clients_.clear();
    ASSERT_TRUE(
        test::wait_until([&] { return server_.ask([&] { return connections_.empty(); }); }));
    most_queued_ = 0;
  }
}

TEST_F(StalledReaderTest, IsClosedWhereAMessageMustArriveAndTheQueueIsFull) {
  open_clients();
  for (std::uint32_t number = 0; number < kMessages; ++number)
    server_->post([this, number] {
      if (connections_.size() == 2)
        connections_[0]->send(MessageKind::kBinary, test::make_payload(make_message(number)),
                              Delivery::kAlways);
    });
  EXPECT_TRUE(test::wait_until([&] { return server_->count_connections() == 1; }));
  server_.ask([&] {
    connections_.at(0)->send(MessageKind::kText, test::make_payload("hello"), Delivery::kAlways);
    return 0;
  });
  EXPECT_EQ(clients_[1].read_frame().payload, "hello");
}

TEST_F(StalledReaderTest, ManyTogetherHaveABoundThatAReaderDoesNotFeel) {
  constexpr std::size_t kClients = 60;
  const std::size_t most = make_options().limits.all_queues_bytes;
  open_clients();
  while (clients_.size() < kClients)
    clients_.push_back(test::open_websocket(server_.port(), "listed"));
  ASSERT_TRUE(test::wait_until(
      [&] { return server_.ask([&] { return connections_.size() == kClients; }); }));
  Connection* const reader = server_.ask([&] { return connections_[1]; });
  for (int i = 0; i < 1'000; ++i) {
    const std::size_t waiting = server_.ask([&] {
      for (Connection* connection : connections_)
        if (connection != reader)
          connection->send(MessageKind::kBinary, test::make_payload(std::string(50'000, 'x')),
                           i < 500 ? Delivery::kDroppable : Delivery::kAlways);
      std::size_t sum = 0;
      for (const Connection* connection : connections_) sum += connection->queued_bytes();
      return sum;
    });
    ASSERT_LE(waiting, most + kClients * (kMostGathered + 50'000));
  }
  server_.ask([&] {
    reader->send(MessageKind::kText, test::make_payload("hello"), Delivery::kAlways);
    return 0;
  });
  EXPECT_EQ(clients_[1].read_frame().payload, "hello");
}

TEST_F(StalledReaderTest, DoesNotHoldUpStop) {
  open_clients();
  server_.ask([&] {
    for (int i = 0; i < 900; ++i)
      connections_[0]->send(MessageKind::kBinary, test::make_payload(std::string(50'000, 'x')),
                            Delivery::kDroppable);
    return 0;
  });
  server_.stop();
  EXPECT_TRUE(connections_.empty());
}

TEST(FloodTest, PingsThatAreNotReadAreNotAnsweredWithoutEnd) {
  ServerOptions options = test::make_options();
  RunningServer server(options, test::add_echo_and_page);
  RawClient flooding = test::open_websocket(server.port(), "other");
  RawClient other = test::open_websocket(server.port(), "other");
  // When its answers find no room the server stops reading: the flood stops.
  ::fcntl(flooding.socket(), F_SETFL, O_NONBLOCK);
  std::string pings;
  for (int i = 0; i < 1'000; ++i) pings += to_bytes({kPing, std::string(125, 'p')});
  auto last_progress = std::chrono::steady_clock::now();
  std::size_t sent = 0;
  EXPECT_TRUE(test::wait_until([&] {
    const auto now = std::chrono::steady_clock::now();
    const ssize_t count = ::send(flooding.socket(), pings.data() + sent % pings.size(),
                                 pings.size() - sent % pings.size(), MSG_NOSIGNAL);
    if (count > 0) {
      sent += static_cast<std::size_t>(count);
      last_progress = now;
    }
    return now - last_progress > std::chrono::milliseconds(500);
  }));
  other.send(to_bytes({kText, "hello"}));
  EXPECT_EQ(other.read_frame().payload, "hello");
}

TEST(FloodTest, ManyMessagesOfOneClientDoNotStarveAnother) {
  RunningServer server(test::make_options(), test::add_echo_and_page);
  RawClient flooding = test::open_websocket(server.port(), "other");
  RawClient other = test::open_websocket(server.port(), "other");
  std::string messages;
  for (int i = 0; i < 1'000; ++i) messages += to_bytes({kText, "flood"});
  std::atomic<bool> is_over{false};
  std::thread sender([&] {
    while (!is_over && flooding.send(messages)) {
    }
  });
  std::thread reader([&] {
    while (flooding.read_frame().opcode == kText) {
    }
  });
  for (int i = 0; i < 20; ++i) {
    other.send(to_bytes({kText, "hello"}));
    EXPECT_EQ(other.read_frame().payload, "hello");
  }
  is_over = true;
  sender.join();
  server.stop();
  reader.join();
}

// --- thousands of connections --------------------------------------------------------------------

std::size_t count_descriptors() {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/fd"))
    ++count;
  return count;
}

TEST(ManyConnectionsTest, ThousandsComeAndGoWithoutALeak) {
  test::Listed::List connections;
  RunningServer server(test::make_options(), [&](Server& prepared) {
    test::add_echo_and_page(prepared);
    prepared.add_protocol(test::make_listed(connections));
  });
  const std::size_t before = count_descriptors();
  for (int i = 0; i < 4'000; ++i) {
    RawClient client(server.port());
    if (i % 4 == 0) client.send(test::make_get("/", server.port()));
    if (i % 4 == 1) client.send("GET / HTT");
    if (i % 4 == 2) client.send(test::make_upgrade(server.port(), "listed"));
    if (i % 8 == 2) client.read_until("\r\n\r\n");
    if (i % 16 == 2) client.send(to_bytes({kBinary, "half"}).substr(0, 4));
  }
  EXPECT_TRUE(test::wait_until([&] { return count_descriptors() == before; }));
  EXPECT_EQ(server->count_connections(), 0u);
  EXPECT_TRUE(server.ask([&] { return connections.empty(); }));
}

/// Takes all file descriptors of this process except one.
class TakenDescriptors {
 public:
  TakenDescriptors() {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    rlimit lower = before_;
    lower.rlim_cur = 128;
    ::setrlimit(RLIMIT_NOFILE, &lower);
    for (int taken; (taken = ::open("/dev/null", O_RDONLY | O_CLOEXEC)) >= 0;)
      taken_.push_back(taken);
    ::close(taken_.back());
    taken_.pop_back();
  }
  ~TakenDescriptors() {
    for (const int taken : taken_) ::close(taken);
    ::setrlimit(RLIMIT_NOFILE, &before_);
  }

 private:
  rlimit before_{};
  std::vector<int> taken_;
};

double calc_thread_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

TEST(ManyConnectionsTest, WaitsWithoutSpinningWhileThereAreNoFileDescriptors) {
  RunningServer server(test::make_options(), test::add_echo_and_page);
  auto taken = std::make_unique<TakenDescriptors>();
  RawClient client(server.port());  // takes the last descriptor; the server has none to accept with
  client.send(test::make_get("/", server.port()));
  const double cpu_before = server.ask(calc_thread_seconds);
  const auto begin = std::chrono::steady_clock::now();
  test::wait_until(
      [&] { return std::chrono::steady_clock::now() - begin > std::chrono::seconds(1); });
  EXPECT_LT(server.ask(calc_thread_seconds) - cpu_before, 0.2);
  taken.reset();
  EXPECT_EQ(client.read_answer().second, "the page");
}

}  // namespace
}  // namespace sls::view
