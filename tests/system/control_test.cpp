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
  void expect_done(const std::vector<std::string>& words) const {
    const Answer answer = control(words);
    EXPECT_EQ(answer.exit_code, 0) << answer.output << flight_.outputs();
  }
  void expect_refused(const std::vector<std::string>& words, const std::string& reason) const {
    const Answer answer = control(words);
    EXPECT_EQ(answer.exit_code, 1) << answer.output;
    EXPECT_NE(answer.output.find(reason), std::string::npos) << answer.output;
  }
  nlohmann::json read_status() const {
    return nlohmann::json::parse(control({"status", "--json"}).output);
  }

  Flight flight_{scenario("figure_eight"), {{}, {"--mode", "realtime"}, {}}};
};

TEST_F(ControlTest, PausesStepsAndResumes) {
  ASSERT_TRUE(flight_.wait_for_steps(50)) << flight_.outputs();
  expect_refused({"step", "5"}, "not paused");
  expect_refused({"resume"}, "not paused");
  expect_done({"pause"});
  expect_refused({"pause"}, "already paused");
  const auto before = read_status();
  EXPECT_EQ(before.at("phase"), "paused");
  expect_done({"step", "25"});
  const auto after = read_status();
  EXPECT_EQ(after.at("phase"), "paused");
  EXPECT_EQ(after.at("step").get<int>(), before.at("step").get<int>() + 25);
  EXPECT_EQ(read_status().at("step"), after.at("step")) << "a paused run does not move";
  expect_done({"resume"});
  ASSERT_TRUE(wait_until(
      [&] { return read_status().at("step").get<int>() > after.at("step").get<int>() + 50; }));
  expect_done({"stop"});
  flight_.wait();
  EXPECT_EQ(flight_.server->wait(), 1);
  EXPECT_NE(flight_.server->output().find("stopped by "), std::string::npos)
      << flight_.server->output();
  const auto manifest = read_manifest(flight_.recording());
  EXPECT_FALSE(manifest.at("complete").get<bool>());
  EXPECT_NE(manifest.at("reason").get<std::string>().find("stopped by "), std::string::npos);
}

TEST_F(ControlTest, ResetBeginsANewRunInASubfolderAndKeepsTheFirst) {
  ASSERT_TRUE(flight_.wait_for_steps(100)) << flight_.outputs();
  const auto first = read_status();
  expect_done({"reset"});
  ASSERT_TRUE(wait_until([&] {
    const auto status = read_status();
    return status.at("run_id") != first.at("run_id") && status.at("step").get<int>() > 50;
  })) << flight_.outputs();
  const auto second = read_status();
  expect_done({"stop"});
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

TEST_F(ControlTest, WatchShowsTheRunUntilItEnds) {
  Process watch({program("sim_ctl"), "--domain", flight_.domain.text(), "status", "--watch"});
  ASSERT_TRUE(flight_.wait_for_steps(300)) << flight_.outputs();
  ASSERT_TRUE(wait_until([&] { return watch.output().find("running") != std::string::npos; }))
      << watch.output();
  expect_done({"stop"});
  EXPECT_EQ(watch.wait(), 0) << watch.output();
  EXPECT_NE(watch.output().find("failed"), std::string::npos) << watch.output();
  flight_.wait();
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
  for (Process* process : {flight.server.get(), flight.client.get()}) {
    EXPECT_EQ(process->wait(), 1) << flight.outputs();
    EXPECT_TRUE(holds(process->output(), cause)) << process->output();
  }
  EXPECT_EQ(flight.recorder->wait(), 1) << flight.outputs();
}

TEST(ControlResetTest, AfterManyQuickResetsLateJoinersFindTheRunAndRecordAllOfIt) {
  OwnDomain domain;
  TemporaryFolder folder;
  const auto start = [&](const char* name, const std::vector<std::string>& flags) {
    return std::make_unique<Process>(make_command(name, domain.number(), flags));
  };
  const auto server = start("sim_server", {"--scenario", scenario("short")});
  for (int i = 0; i < 6; ++i) {
    const auto reset = start("sim_ctl", {"reset"});
    ASSERT_EQ(reset->wait(), 0) << i << reset->output() << server->output();
  }
  const auto client = start("control_client", {"--scenario", scenario("short")});
  const auto recorder = start("recorder", {"--out", folder / "recording"});
  EXPECT_EQ(server->wait(), 0) << server->output();
  EXPECT_EQ(client->wait(), 0) << client->output();
  EXPECT_EQ(recorder->wait(), 0) << recorder->output();
  EXPECT_TRUE(read_manifest(folder / "recording").at("complete").get<bool>());
  EXPECT_EQ(Table(folder / "recording/status.csv").text(0, "sample_index"), "0");
}

}  // namespace
}  // namespace sls::test
