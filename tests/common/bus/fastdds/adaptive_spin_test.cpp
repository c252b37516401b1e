// Counts the looks of AdaptiveSpin, and tests the functions of the C library that use it. This
// program replaces them as the server does.
#include "common/bus/fastdds/adaptive_spin.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sched.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <ctime>
#include <string>
#include <thread>

#include "common/bus/spinning.hpp"
#include "tests/support/waiting.hpp"

namespace sls::bus {
namespace {

/// Waits once; true if it looked at all.
bool looks(AdaptiveSpin& spin, bool is_there) {
  int count = 0;
  spin.wait_for([&] { return ++count, is_there; });
  return count > 0;
}

/// Number of waits that sleep at once before a wait looks again.
int count_skipped(AdaptiveSpin& spin, bool is_there) {
  int skipped = 0;
  while (!looks(spin, is_there)) ++skipped;
  return skipped;
}

TEST(AdaptiveSpinTest, AnAvailableItemIsFoundAtTheFirstLook) {
  AdaptiveSpin spin(16);
  int count = 0;
  for (int i = 1; i <= 3; ++i) {
    EXPECT_TRUE(spin.wait_for([&] { return ++count > 0; }));
    EXPECT_EQ(count, i);
  }
}

TEST(AdaptiveSpinTest, AnItemThatComesDuringTheSpinIsFound) {
  AdaptiveSpin spin(16);
  int count = 0;
  EXPECT_TRUE(spin.wait_for([&] { return ++count == 10; }));
  EXPECT_EQ(count, 10);
}

TEST(AdaptiveSpinTest, FailuresInARowSkipTwiceAsManyWaitsUpToALimit) {
  AdaptiveSpin spin(1);
  EXPECT_TRUE(looks(spin, false));
  for (int expected = 1; expected < AdaptiveSpin::kMostSkipped; expected = 2 * expected + 1)
    EXPECT_EQ(count_skipped(spin, false), expected);
  for (int time = 0; time < 2; ++time)
    EXPECT_EQ(count_skipped(spin, false), AdaptiveSpin::kMostSkipped);
}

TEST(AdaptiveSpinTest, ASuccessHalvesTheWaitsThatAreSkipped) {
  AdaptiveSpin spin(1);
  looks(spin, false);
  for (const int expected : {1, 3, 7}) EXPECT_EQ(count_skipped(spin, false), expected);
  for (const int expected : {15, 7, 3, 1, 0, 0}) EXPECT_EQ(count_skipped(spin, true), expected);
}

TEST(AdaptiveSpinTest, ItGivesUp) {
  AdaptiveSpin spin(16);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_FALSE(spin.wait_for([] { return false; }));
  EXPECT_GE(std::chrono::steady_clock::now() - start, AdaptiveSpin::kLongest);
}

TEST(SpinningTest, TheEnvironmentSwitchesItOff) {
  setenv("SLS_SPIN", "off", 1);
  start_spinning();
  EXPECT_FALSE(is_spinning);
  unsetenv("SLS_SPIN");
}

TEST(SpinningTest, NoThreadSpinsOnOneProcessor) {
  cpu_set_t before;
  ASSERT_EQ(sched_getaffinity(0, sizeof(before), &before), 0);
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(sched_getcpu(), &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);
  start_spinning();
  EXPECT_FALSE(is_spinning);
  ASSERT_EQ(sched_setaffinity(0, sizeof(before), &before), 0);
  start_spinning();
  EXPECT_EQ(is_spinning, CPU_COUNT(&before) > 1);
  stop_spinning();
  EXPECT_FALSE(is_spinning);
}

/// With and without spinning the caller gets the same results.
class ReceivingTest : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override { is_spinning = GetParam(); }
  void TearDown() override { is_spinning = false; }
};

class SocketPair {
 public:
  SocketPair() {
    for (const int end : {receiver_, sender_}) {
      sockaddr_in address{};
      address.sin_family = AF_INET;
      address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      EXPECT_EQ(bind(end, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    }
    const sockaddr_in to = address_of(receiver_);
    EXPECT_EQ(connect(sender_, reinterpret_cast<const sockaddr*>(&to), sizeof(to)), 0);
  }
  ~SocketPair() {
    close(receiver_);
    close(sender_);
  }

  static sockaddr_in address_of(int socket) {
    sockaddr_in address{};
    socklen_t length = sizeof(address);
    EXPECT_EQ(getsockname(socket, reinterpret_cast<sockaddr*>(&address), &length), 0);
    return address;
  }

  void send(const std::string& text) const {
    EXPECT_EQ(::send(sender_, text.data(), text.size(), 0), static_cast<ssize_t>(text.size()));
  }

  /// The received datagram and its port, or the error.
  std::string receive(int flags, in_port_t* port = nullptr) const {
    std::string buffer(100, '\0');
    sockaddr_in from{};
    socklen_t length = sizeof(from);
    const ssize_t count = recvfrom(receiver_, buffer.data(), buffer.size(), flags,
                                   reinterpret_cast<sockaddr*>(&from), &length);
    if (count < 0) return "error " + std::to_string(errno);
    EXPECT_EQ(length, sizeof(from));
    if (port) *port = from.sin_port;
    return buffer.substr(0, static_cast<std::size_t>(count));
  }

  int receiver_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  int sender_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

TEST_P(ReceivingTest, DatagramsArriveWholeWithTheirSender) {
  const SocketPair sockets;
  std::atomic<int> received{0};
  std::thread sender([&] {
    for (int i = 0; i < 1000; ++i) {
      while (i - received > 50) std::this_thread::yield();  // the socket's buffer holds 50
      sockets.send("datagram " + std::to_string(i));
    }
  });
  for (; received < 1000; ++received) {
    in_port_t port = 0;
    EXPECT_EQ(sockets.receive(0, &port), "datagram " + std::to_string(received));
    EXPECT_EQ(port, SocketPair::address_of(sockets.sender_).sin_port);
  }
  sender.join();
}

TEST_P(ReceivingTest, ADatagramThatComesLateWakesTheReceiver) {
  const SocketPair sockets;
  std::atomic<pid_t> id{0};
  std::thread receiver([&] {
    id = gettid();
    EXPECT_EQ(sockets.receive(0), "late");
  });
  EXPECT_TRUE(test::wait_until([&] { return id != 0 && test::find_state(id) == 'S'; }));
  sockets.send("late");
  receiver.join();
}

TEST_P(ReceivingTest, TheSocketsOwnTimeLimitHolds) {
  const SocketPair sockets;
  timeval limit{};
  limit.tv_usec = 200'000;
  setsockopt(sockets.receiver_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(sockets.receive(0), "error " + std::to_string(EAGAIN));
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(200));
}

TEST_P(ReceivingTest, ANonBlockingReceiveReturnsAtOnce) {
  const SocketPair sockets;
  EXPECT_EQ(sockets.receive(MSG_DONTWAIT), "error " + std::to_string(EAGAIN));
}

TEST_P(ReceivingTest, AnInvalidSocketIsAnError) {
  char byte = 0;
  EXPECT_EQ(recvfrom(-1, &byte, 1, 0, nullptr, nullptr), -1);
  EXPECT_EQ(errno, EBADF);
}

TEST_P(ReceivingTest, APortsSemaphoreIsTakenOncePerPost) {
  void* memory = mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  auto* semaphore = reinterpret_cast<sem_t*>(static_cast<char*>(memory) + 64);  // as in a port
  ASSERT_EQ(sem_init(semaphore, 1, 0), 0);
  constexpr int kPosts = 1000;
  std::thread poster([&] {
    for (int i = 0; i < kPosts; ++i) sem_post(semaphore);
  });
  timespec deadline{};
  clock_gettime(CLOCK_REALTIME, &deadline);
  deadline.tv_sec += 60;
  for (int taken = 0; taken < kPosts;) {
    if (sem_timedwait(semaphore, &deadline) == 0) {
      ++taken;
    } else {
      ASSERT_EQ(errno, ETIMEDOUT);  // a reader's wait returns early
    }
  }
  poster.join();
  EXPECT_EQ(sem_trywait(semaphore), -1);
  munmap(memory, 4096);
}

INSTANTIATE_TEST_SUITE_P(Spinning, ReceivingTest, testing::Bool(), [](const auto& test) {
  return std::string(test.param ? "Spinning" : "Sleeping");
});

}  // namespace
}  // namespace sls::bus
