/// A client dies or stops while it holds a lock of a shared-memory port, or of the notification of
/// a reader that shares data (its own or that of another process). The others continue, at the
/// latest when the stopped client continues, and none dies.
#include <gtest/gtest.h>
#include <signal.h>

#include <tuple>

#include "common/bus/fastdds/stale_segments.hpp"
#include "fastdds_files.hpp"
#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

/// Parameters: whether server and client share data; the lock of the messages, or the lock of the
/// list of the waiting readers.
class SharedLockTest : public testing::TestWithParam<std::tuple<bool, const char*>> {
 protected:
  /// Starts a flight of two clients. The primary sends itself `signal` in the middle of the flight,
  /// while it holds a lock of its own port or of another process's port.
  void start(int signal, const std::string& port) {
    const std::string file =
        make_scenario(folder_, {{"controllers: 1", "controllers: 2"}, {"for_s: 32", "for_s: 16"}},
                      "figure_eight");
    start_primary(file, signal, port);
    standby_ = std::make_unique<Process>(
        make_command("control_client", flight_->domain.number(),
                     {"--scenario", file, "--name", "standby", "--strength", "1"}));
  }

  void start_primary(const std::string& file, int signal, const std::string& port) {
    const auto [shares_data, kind] = GetParam();
    FlightOptions options{{}, {}, {"--name", "primary", "--strength", "2"}, {}};
    if (!shares_data) options.qos_file = make_qos_without_shared_data();
    options.before["control_client"] = {
        "env",
        std::string("LD_PRELOAD=") + SLS_LOCK_SHIM,
        "SLS_LOCK_PORT=" + port,
        std::string("SLS_LOCK_KIND=") + kind,
        "SLS_LOCK_OF=" + (shares_data ? bus::kDataSharingPrefix
                                      : std::string(bus::kSharedMemoryPrefix) + "port"),
        "SLS_LOCK_COUNT=1500",
        "SLS_LOCK_SIGNAL=" + std::to_string(signal)};
    flight_ = std::make_unique<Flight>(file, options);
  }

  /// The same profiles as the programs' own, but the loop uses the ports.
  std::string make_qos_without_shared_data() const {
    const std::string endpoints = read_file(qos("endpoints"));
    const std::string file = folder_ / "ports.xml";
    std::string profiles;
    for (const std::string kind : {"writer", "reader"}) {
      const std::string end = "</data_" + kind + ">";
      const auto from = endpoints.find("<data_" + kind + " profile_name=\"sls_loop_");
      profiles +=
          replace_once(endpoints.substr(from, endpoints.find(end, from) + end.size() - from),
                       "AUTOMATIC", "OFF");
    }
    write_bytes(file, replace_once(read_file(qos("default")), "\n  </profiles>",
                                   profiles + "\n  </profiles>"));
    return file;
  }

  bool is_said(const char* words) const { return holds(flight_->server->output(), words); }

  bool is_primary_stopped() const { return find_state(flight_->client->id()) == 'T'; }

  /// Expects the result of the flight without the primary.
  void expect_result() {
    EXPECT_EQ(flight_->server->wait(), 0) << flight_->outputs();
    EXPECT_EQ(standby_->wait(), 0) << standby_->output();
    EXPECT_EQ(flight_->recorder->wait(), 0) << flight_->outputs();
    expect_undisturbed(flight_->recording(), folder_ / "scenario.yaml");
  }

  /// No process waits until the primary is presumed dead (2 s): a wait of 1 s would print a
  /// message.
  void expect_take_over() {
    expect_result();
    EXPECT_FALSE(is_said("waiting for: controller '")) << flight_->outputs();
    EXPECT_TRUE(is_said("'standby' takes over from 'primary'")) << flight_->outputs();
  }

  TemporaryFolder folder_;
  std::unique_ptr<Flight> flight_;
  std::unique_ptr<Process> standby_;
};

TEST_P(SharedLockTest, OfItsOwnPortWithADeadClient) {
  start(SIGKILL, "own");
  expect_take_over();
}

TEST_P(SharedLockTest, OfAnotherPortWithADeadClient) {
  start(SIGKILL, "other");
  expect_take_over();
}

TEST_P(SharedLockTest, OfItsOwnPortWithAStoppedClient) {
  start(SIGSTOP, "own");
  expect_take_over();
  EXPECT_TRUE(is_primary_stopped());
  flight_->client->kill();
}

TEST_P(SharedLockTest, OfAnotherPortWithAStoppedClient) {
  start(SIGSTOP, "other");
  ASSERT_TRUE(wait_until([&] { return is_primary_stopped(); })) << flight_->outputs();
  // The primary's samples no longer arrive, or the standby or the recorder is cut off as well.
  ASSERT_TRUE(wait_until([&] { return is_said("takes over") || is_said("silent since"); }))
      << flight_->outputs();
  flight_->client->send(SIGCONT);
  expect_result();
  EXPECT_EQ(flight_->client->wait(), 0) << flight_->client->output();
}

/// The client stays stopped. The lock that it holds is mostly that of the server's port.
TEST_P(SharedLockTest, OfAnotherPortWithAStoppedClientDoesNotKeepTheServerFromEnding) {
  const std::string file =
      make_scenario(folder_,
                    {{"timeout_s: 30 }",
                      "timeout_s: 30 }, wait: { controller: { policy: stop, deadline_s: 1 } }"}},
                    "figure_eight");
  start_primary(file, SIGSTOP, "other");
  EXPECT_EQ(flight_->server->wait(), 1) << flight_->outputs();
  EXPECT_TRUE(is_said("waited 1 s for controller 'primary'")) << flight_->outputs();
  EXPECT_TRUE(is_primary_stopped());
  flight_->client->kill();
  EXPECT_EQ(flight_->recorder->wait(), 1) << flight_->outputs();
}

INSTANTIATE_TEST_SUITE_P(, SharedLockTest,
                         testing::Combine(testing::Bool(), testing::Values("messages", "waiters")),
                         [](const auto& kind) {
                           return (std::get<0>(kind.param) ? "shared_data_" : "port_") +
                                  std::string(std::get<1>(kind.param));
                         });

}  // namespace
}  // namespace sls::test
