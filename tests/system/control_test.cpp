/// Operator control of real flights with `sim_ctl`, through sls/control and sls/control_reply.
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;

struct Answer {
  int exit_code = -1;
  std::string output;
};

class ControlTest : public ::testing::Test {
 protected:
  Answer control(std::vector<std::string> words) const {
    words.insert(words.begin(), {program("sim_ctl"), "--domain", flight_.domain.text()});
    Process process(words);
    const auto code = process.wait();
    return {code.value_or(-1), process.output()};
  }
  nlohmann::json read_status() const {
    return nlohmann::json::parse(control({"status", "--json"}).output);
  }

  Flight flight_{scenario("figure_eight"), {{}, {"--mode", "realtime"}, {}}};
};

TEST_F(ControlTest, ResetBeginsANewRunInASubfolderAndKeepsTheFirst) {
  ASSERT_TRUE(flight_.wait_for_steps(100)) << flight_.outputs();
  const auto first = read_status();
  const Answer refused = control({"resume"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(holds(refused.output, "not paused")) << refused.output;
  const Answer reset = control({"reset"});
  EXPECT_EQ(reset.exit_code, 0) << reset.output;
  ASSERT_TRUE(wait_until([&] {
    const auto status = read_status();
    return status.at("run_id") != first.at("run_id") && status.at("step").get<int>() > 50;
  })) << flight_.outputs();
  const auto second = read_status();
  const Answer stop = control({"stop"});
  EXPECT_EQ(stop.exit_code, 0) << stop.output;
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
  Process reset({program("sim_ctl"), "--domain", flight.domain.text(), "reset"});
  EXPECT_EQ(reset.wait(), 0) << reset.output();
  flight.wait();
  const std::string cause = "Resource temporarily unavailable";
  for (Process* process : {flight.server.get(), flight.client.get(), flight.recorder.get()}) {
    EXPECT_EQ(process->wait(), 1) << flight.outputs();
    EXPECT_TRUE(holds(process->output(), cause)) << process->output();
  }
}

}  // namespace
}  // namespace sls::test
