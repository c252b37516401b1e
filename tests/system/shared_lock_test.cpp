/// A client dies or stops while it holds the lock of a shared-memory port, its own or that of
/// another process: the others go on, and nobody dies with it.
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/support/text.hpp"
#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

class SharedLockTest : public testing::Test {
 protected:
  /// Starts a flight of two clients. The primary sends itself `signal` in the middle of the flight,
  /// while it holds the lock of its own port or that of another process.
  void start(int signal, const std::string& port) {
    const std::string file = folder_ / "scenario.yaml";
    write_bytes(file, replace_once(read_file(scenario("figure_eight")), "controllers: 1",
                                   "controllers: 2"));
    FlightOptions options{{}, {}, {"--name", "primary", "--strength", "2"}, {}};
    options.before["control_client"] = {"env", std::string("LD_PRELOAD=") + SLS_LOCK_SHIM,
                                        "SLS_LOCK_PORT=" + port, "SLS_LOCK_COUNT=3000",
                                        "SLS_LOCK_SIGNAL=" + std::to_string(signal)};
    flight_ = std::make_unique<Flight>(file, options);
    standby_ = std::make_unique<Process>(
        make_command("control_client", flight_->domain.number(),
                     {"--scenario", file, "--name", "standby", "--strength", "1"}));
  }

  bool is_said(const Process& process, const char* words) const {
    return process.output().find(words) != std::string::npos;
  }

  /// Of the flight without the primary.
  void expect_result() {
    EXPECT_EQ(flight_->server->wait(), 0) << flight_->outputs();
    EXPECT_EQ(standby_->wait(), 0) << standby_->output();
    EXPECT_EQ(flight_->recorder->wait(), 0) << flight_->outputs();
    Flight undisturbed(scenario("figure_eight"));
    undisturbed.expect_success();
    EXPECT_TRUE(read_file(undisturbed.recording() / "state.csv") ==
                read_file(flight_->recording() / "state.csv"));
  }

  void expect_take_over() {
    expect_result();
    EXPECT_TRUE(is_said(*flight_->server, "'standby' takes over from 'primary'"))
        << flight_->outputs();
  }

  TemporaryFolder folder_;
  std::unique_ptr<Flight> flight_;
  std::unique_ptr<Process> standby_;
};

TEST_F(SharedLockTest, OfTheOwnPortWithADeadClient) {
  start(SIGKILL, "own");
  expect_take_over();
}

TEST_F(SharedLockTest, OfAnotherPortWithADeadClient) {
  start(SIGKILL, "other");
  expect_take_over();
}

TEST_F(SharedLockTest, OfTheOwnPortWithAStoppedClient) {
  start(SIGSTOP, "own");
  expect_take_over();
  flight_->client->kill();
}

TEST_F(SharedLockTest, OfAnotherPortWithAStoppedClient) {
  start(SIGSTOP, "other");
  // Whose port it is, decides what is said first; if it is the standby's, nobody misses anything.
  ASSERT_TRUE(wait_until([&] {
    return is_said(*flight_->server, "takes over") || is_said(*flight_->server, "waiting for") ||
           is_said(*flight_->server, "finished");
  })) << flight_->outputs();
  flight_->client->send(SIGCONT);
  expect_result();
  flight_->client->wait();
}

}  // namespace
}  // namespace sls::test
