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
#include <thread>

namespace sls::app {
namespace {

class StopSignalDeathTest : public testing::Test {
 protected:
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

TEST_F(StopSignalDeathTest, NoSignalIsReportedBeforeTheFirst) {
  EXPECT_EXIT(
      {
        install_stop_signals();
        std::exit(stop_signal());
      },
      testing::ExitedWithCode(0), "");
}

TEST_F(StopSignalDeathTest, StopSignalsSetTheFlagOnlyAlsoIfTheyWereBlocked) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP})
    EXPECT_EXIT(
        {
          sigset_t blocked;
          sigfillset(&blocked);
          pthread_sigmask(SIG_BLOCK, &blocked, nullptr);
          install_stop_signals();
          std::raise(number);
          std::exit(stop_signal());
        },
        testing::ExitedWithCode(number), "");
}

TEST_F(StopSignalDeathTest, AHangUpIgnoredAtTheStartStaysIgnored) {
  EXPECT_EXIT(
      {
        std::signal(SIGHUP, SIG_IGN);
        install_stop_signals();
        std::raise(SIGHUP);
        std::exit(stop_signal());
      },
      testing::ExitedWithCode(0), "");
}

TEST_F(StopSignalDeathTest, TheFirstSignalCounts) {
  EXPECT_EXIT(
      {
        install_stop_signals();
        std::raise(SIGTERM);
        std::raise(SIGINT);
        std::raise(SIGINT);
        std::exit(stop_signal());
      },
      testing::ExitedWithCode(SIGTERM), "");
}

TEST_F(StopSignalDeathTest, ASignalThatAnotherThreadReceivesIsSeen) {
  EXPECT_EXIT(
      {
        install_stop_signals();
        std::thread receiver([] { pthread_kill(pthread_self(), SIGINT); });
        while (stop_signal() == 0) std::this_thread::yield();  // ctest's time limit ends it
        receiver.join();
        std::exit(stop_signal());
      },
      testing::ExitedWithCode(SIGINT), "");
}

TEST_F(StopSignalDeathTest, AProgramThatHangsAfterTheSignalExitsWithAnErrorLine) {
  EXPECT_EXIT(
      {
        install_stop_signals(std::chrono::seconds(1));
        std::raise(SIGTERM);
        while (true) ::pause();
      },
      testing::ExitedWithCode(128 + SIGTERM), "^[^ ]+: error: did not end after the stop signal");
}

TEST_F(StopSignalDeathTest, WorkThatMayTakeLongIsNotEnded) {
  EXPECT_EXIT(
      {
        install_stop_signals(std::chrono::seconds(1));
        {
          const Unhurried before;
          std::raise(SIGTERM);
          std::this_thread::sleep_for(std::chrono::milliseconds(1500));
        }
        const Unhurried after;
        std::this_thread::sleep_for(std::chrono::milliseconds(1500));
        std::exit(stop_signal());
      },
      testing::ExitedWithCode(SIGTERM), "");
}

TEST_F(StopSignalDeathTest, AProgramThatHangsAfterSuchWorkExits) {
  EXPECT_EXIT(
      {
        install_stop_signals(std::chrono::seconds(1));
        {
          const Unhurried work;
          std::raise(SIGTERM);
        }
        while (true) ::pause();
      },
      testing::ExitedWithCode(128 + SIGTERM), "^[^ ]+: error: did not end after the stop signal");
}

TEST_F(StopSignalDeathTest, ABrokenPipeIsReportedByTheWrite) {
  EXPECT_EXIT(
      {
        install_stop_signals();
        int ends[2];
        if (::pipe(ends) != 0) std::exit(1);
        ::close(ends[0]);
        const auto count = ::write(ends[1], "x", 1);
        std::exit(count == -1 && errno == EPIPE ? 0 : 2);
      },
      testing::ExitedWithCode(0), "");
}

TEST_F(StopSignalDeathTest, AFileSizeLimitIsReportedByTheWrite) {
  EXPECT_EXIT(
      {
        install_stop_signals();
        rlimit limit{};
        limit.rlim_max = RLIM_INFINITY;
        if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) std::exit(1);
        FILE* file = std::tmpfile();  // has no name, so nothing stays behind
        if (!file) std::exit(2);
        std::fputs("x", file);
        std::exit(std::fflush(file) != 0 && errno == EFBIG ? 0 : 3);
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace sls::app
