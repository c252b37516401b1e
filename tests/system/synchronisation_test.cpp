/// Real time, with real processes that are stopped and continued.
#include <gtest/gtest.h>
#include <signal.h>

#include <string>

#include "tests/system/flight.hpp"
#include "tests/system/operator.hpp"

namespace sls::test {
namespace {

std::string read_timing(const std::filesystem::path& recording) {
  return read_manifest(recording).at("timing").get<std::string>();
}

TEST(RealTimeTest, WithoutLateAnswersTheRecordingIsThatOfLockstep) {
  TemporaryFolder folder;
  const std::string file = make_scenario(folder, {{"for_s: 2", "for_s: 0.4"}});
  // A busy machine may be late; a slower flight leaves more time per period.
  for (const char* real_time_factor : {"0.2", "0.1", "0.05", "0.02"}) {
    Flight flight(file, {{}, {"--mode", "realtime", "--rtf", real_time_factor}, {}});
    flight.expect_success();
    const auto manifest = read_manifest(flight.recording());
    EXPECT_EQ(manifest.at("mode"), "realtime");
    const Table status(flight.recording() / "status.csv");
    EXPECT_LE(status.number(status.rows() - 1, "real_time_factor"),
              1.002 * std::stod(real_time_factor));  // the machine can only make it slower
    const std::string timing = read_timing(flight.recording());
    ASSERT_TRUE(holds(timing, "real-time, ")) << timing;
    if (!holds(timing, "real-time, 0 of 100 late")) continue;
    expect_undisturbed(flight.recording(), file);
    return;
  }
  FAIL() << "late even at 200 ms per period";
}

TEST(RealTimeTest, AStoppedClientIsReplacedByTheFailSafeAndFliesAgainWhenItReturns) {
  TemporaryFolder folder;
  const std::string file = make_scenario(folder, {{"for_s: 32", "for_s: 8"}}, "figure_eight");
  Flight flight(file, {{}, {"--mode", "realtime"}, {}});
  ASSERT_TRUE(flight.wait_for_steps(500)) << flight.outputs();
  flight.client->send(SIGSTOP);
  ASSERT_TRUE(wait_until([&] { return holds(flight.server->output(), "fail-safe force"); }))
      << flight.outputs();
  EXPECT_TRUE(holds(flight.server->output(), "controller 'control_client'"));
  flight.client->send(SIGCONT);
  flight.expect_success();
  EXPECT_TRUE(holds(flight.server->output(), "'control_client' answers again"))
      << flight.server->output();
  const std::string timing = read_timing(flight.recording());
  EXPECT_EQ(timing.rfind("degraded: real-time, ", 0), 0u) << timing;
  // The last force is held for max_hold_s, 0.5 s of simulation time. Then the fail-safe force acts.
  const Table commands(flight.recording() / "command.csv");
  std::size_t held = 0, fail_safe = 0;
  for (std::size_t row = 0; row < commands.rows(); ++row) {
    held = commands.text(row, "fault") == "held" ? held + 1 : 0;
    EXPECT_LE(held, 125u) << "row " << row;
    fail_safe += commands.text(row, "fault") == "fail_safe" ? 1 : 0;
  }
  EXPECT_GT(fail_safe, 0u);
  EXPECT_EQ(commands.rows(), 2001u) << "one row per step";
  // The load is not lost: within 2 m of its reference at the end.
  const TrackingError end = calc_tracking_error(flight.recording(), 2000, 2000);
  EXPECT_LT(end.max.maxCoeff(), 2.0);
  EXPECT_TRUE(holds(read_file(flight.recording() / "status.csv"), "applying the fail-safe force"));
}

/// A step takes 1,000 s of wall time: the server is always between two steps.
TEST(RealTimeTest, TheServerAnnouncesAndReceivesUntilTheNextStateIsDue) {
  TemporaryFolder folder;
  const OwnDomain domain;
  const std::string file = make_scenario(folder, {{"recorders: 1", "recorders: 0"}});
  const auto start = [&](const char* name, const std::vector<std::string>& flags) {
    return make_command(name, domain.number(),
                        std::vector<std::string>{"--scenario", file} + flags);
  };
  Process server(start("sim_server", {"--mode", "realtime", "--rtf", "0.001", "--period-s", "1"}));
  Operator someone(domain.number());
  ASSERT_EQ(someone.ask(ControlAction::ACTION_PAUSE), "") << server.output();
  Process client(start("control_client", {}));
  ASSERT_TRUE(someone.wait_for(RunPhase::PHASE_PAUSED)) << server.output() << client.output();
  ASSERT_EQ(someone.ask(ControlAction::ACTION_STEP, 1), "") << server.output();
  ASSERT_EQ(someone.ask(ControlAction::ACTION_RESUME), "") << server.output();
  ASSERT_TRUE(someone.wait_for_statuses(5)) << server.output();
  ASSERT_EQ(someone.ask(ControlAction::ACTION_PAUSE), "") << server.output();
  ASSERT_EQ(someone.ask(ControlAction::ACTION_RESUME), "") << server.output();
  server.send(SIGTERM);
  EXPECT_EQ(server.wait(std::chrono::seconds(60)), 143) << server.output();
}

}  // namespace
}  // namespace sls::test
