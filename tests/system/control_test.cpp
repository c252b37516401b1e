/// Operator control of real flights with `sim_ctl`, through sls/control and sls/control_reply.
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;

class ControlTest : public ::testing::Test {
 protected:
  std::string control(const Words& words, int code = 0) const {
    return expect_exit(make_command("sim_ctl", flight_.domain.number(), words), code);
  }
  nlohmann::json read_status() const {
    return nlohmann::json::parse(control({"status", "--json"}));
  }

  Flight flight_{scenario("figure_eight"), {{}, {"--mode", "realtime"}, {}}};
};

TEST_F(ControlTest, ResetBeginsANewRunInASubfolderAndKeepsTheFirst) {
  ASSERT_TRUE(flight_.wait_for_steps(100)) << flight_.outputs();
  const auto first = read_status();
  const std::string refused = control({"resume"}, 1);
  EXPECT_TRUE(holds(refused, "not paused")) << refused;
  control({"reset"});
  ASSERT_TRUE(wait_until([&] {
    const auto status = read_status();
    return status.at("run_id") != first.at("run_id") && status.at("step").get<int>() > 50;
  })) << flight_.outputs();
  const auto second = read_status();
  control({"stop"});
  flight_.wait();
  EXPECT_EQ(read_manifest(flight_.recording()).at("outcome"), "reset");
  EXPECT_EQ(read_manifest(flight_.recording()).at("run_id"), first.at("run_id"));
  const fs::path folder = flight_.recording() / ("run-" + second.at("run_id").get<std::string>());
  ASSERT_TRUE(fs::exists(folder / "manifest.json")) << flight_.outputs();
  EXPECT_EQ(read_manifest(folder).at("run_id"), second.at("run_id"));
  // Both began at step 0 with the same state.
  const Table a(flight_.recording() / "state.csv"), b(folder / "state.csv");
  ASSERT_GT(b.rows(), 0u);
  for (const char* column : {"step", "quad_x_m", "load_z_m", "force_z_n"})
    EXPECT_EQ(a.text(0, column), b.text(0, column));
}

TEST(ResetTest, ASuccessorThatCannotBeMadeEndsTheRunWithItsCause) {
  TemporaryFolder folder;
  const std::string no_threads = folder / "no_threads";
  FlightOptions options{{}, {"--mode", "realtime"}, {}, {}};
  options.before["sim_server"] = {"env", std::string("LD_PRELOAD=") + SLS_THREAD_SHIM,
                                  "SLS_NO_THREADS=" + no_threads};
  Flight flight(scenario("figure_eight"), options);
  ASSERT_TRUE(flight.wait_for_steps(50)) << flight.outputs();
  write_bytes(no_threads, "");  // the next run's state queue needs a thread
  expect_success({flight.start("sim_ctl", {"reset"}).get()});
  flight.wait();
  const std::string cause = "Resource temporarily unavailable";
  for (Process* process : {flight.server.get(), flight.client.get(), flight.recorder.get()}) {
    EXPECT_EQ(process->wait(), 1) << flight.outputs();
    EXPECT_TRUE(
        holds(process->output(), process == flight.recorder.get() ? "manifest.json" : cause))
        << process->output();
  }
}

}  // namespace
}  // namespace sls::test
