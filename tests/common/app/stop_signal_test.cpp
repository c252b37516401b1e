// Real signals. The flag lasts as long as its process: each test runs in its own process.
#include "common/app/stop_signal.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <thread>

namespace sls::app {
namespace {

class StopSignalDeathTest : public testing::Test {
 protected:
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }

  /// Expects that a process with stop signals exits with `code` and `message` after `work`; if the
  /// work returns, `code` is the signal.
  static void expect_exit(int code, const std::function<void()>& work, const char* message = "") {
    const auto be_the_process = [&] {
      install_stop_signals(std::chrono::seconds(1));
      work();
      std::exit(stop_signal());
    };
    EXPECT_EXIT(be_the_process(), testing::ExitedWithCode(code), message);
  }
};

constexpr const char* kHung = "^[^ ]+: error: did not end after the stop signal";

TEST_F(StopSignalDeathTest, NoSignalIsReportedBeforeTheFirst) {
  expect_exit(0, [] {});
}

TEST_F(StopSignalDeathTest, StopSignalsSetTheFlagOnlyAlsoIfTheyWereBlocked) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP})
    expect_exit(number, [&] {
      sigset_t all;
      sigfillset(&all);
      pthread_sigmask(SIG_BLOCK, &all, nullptr);
      install_stop_signals();
      std::raise(number);
    });
}

TEST_F(StopSignalDeathTest, AHangUpIgnoredAtTheStartStaysIgnored) {
  expect_exit(0, [] {
    std::signal(SIGHUP, SIG_IGN);
    install_stop_signals();
    std::raise(SIGHUP);
  });
}

TEST_F(StopSignalDeathTest, TheFirstSignalCounts) {
  expect_exit(SIGTERM, [] {
    for (const int number : {SIGTERM, SIGINT, SIGINT}) std::raise(number);
  });
}

TEST_F(StopSignalDeathTest, ASignalThatAnotherThreadReceivesIsSeen) {
  expect_exit(SIGINT, [] {
    std::thread receiver([] { pthread_kill(pthread_self(), SIGINT); });
    while (stop_signal() == 0) std::this_thread::yield();  // ctest's time limit ends it
    receiver.join();
  });
}

TEST_F(StopSignalDeathTest, AProgramThatHangsAfterTheSignalExitsWithAnErrorLine) {
  const auto hang = [] {
    std::raise(SIGTERM);
    while (true) ::pause();
  };
  expect_exit(128 + SIGTERM, hang, kHung);
}

TEST_F(StopSignalDeathTest, WorkThatMayTakeLongIsNotEnded) {
  expect_exit(SIGTERM, [] {
    {
      const Unhurried before;
      std::raise(SIGTERM);
      std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    }
    const Unhurried after;
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  });
}

TEST_F(StopSignalDeathTest, AProgramThatHangsAfterSuchWorkExits) {
  const auto work_and_hang = [] {
    {
      const Unhurried work;
      std::raise(SIGTERM);
    }
    while (true) ::pause();
  };
  expect_exit(128 + SIGTERM, work_and_hang, kHung);
}

TEST_F(StopSignalDeathTest, ABrokenPipeIsReportedByTheWrite) {
  expect_exit(0, [] {
    int ends[2];
    if (::pipe(ends) != 0) std::exit(1);
    ::close(ends[0]);
    if (::write(ends[1], "x", 1) != -1 || errno != EPIPE) std::exit(2);
  });
}

TEST_F(StopSignalDeathTest, AFileSizeLimitIsReportedByTheWrite) {
  expect_exit(0, [] {
    rlimit limit{};
    limit.rlim_max = RLIM_INFINITY;
    if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) std::exit(1);
    FILE* file = std::tmpfile();  // has no name, so nothing stays behind
    if (!file) std::exit(2);
    std::fputs("x", file);
    if (std::fflush(file) == 0 || errno != EFBIG) std::exit(3);
  });
}

}  // namespace
}  // namespace sls::app
