/// One scenario, one result: no disturbance of a lockstep flight changes its certificate. The
/// effect of a scenario's faults depends only on simulation time.
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>

#include <thread>

#include "closed_loop/flight.hpp"
#include "tests/system/flight.hpp"
#include "tests/system/load.hpp"

namespace sls::test {
namespace {

std::string read_certificate(const std::filesystem::path& recording) {
  return read_manifest(recording).at("certificate").get<std::string>();
}

/// While it exists, new processes run only on the first core.
class OneCore {
 public:
  OneCore() {
    sched_getaffinity(0, sizeof before_, &before_);
    cpu_set_t one;
    CPU_ZERO(&one);
    for (int core = 0; core < CPU_SETSIZE; ++core)
      if (CPU_ISSET(core, &before_)) {
        CPU_SET(core, &one);
        break;
      }
    sched_setaffinity(0, sizeof one, &one);
  }
  ~OneCore() { sched_setaffinity(0, sizeof before_, &before_); }

 private:
  cpu_set_t before_{};
};

class OneResultTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    Flight flight(scenario("figure_eight"));
    flight.expect_success();
    certificate_ = read_certificate(flight.recording());
    ASSERT_EQ(certificate_.size(), 64u);
  }

  static void expect_same(Flight& flight) {
    flight.expect_success();
    EXPECT_EQ(read_certificate(flight.recording()), certificate_);
  }

  static std::string certificate_;
};

std::string OneResultTest::certificate_;

TEST_F(OneResultTest, OverUdp) {
  Flight flight(scenario("figure_eight"), {qos("udp"), {}, {}});
  expect_same(flight);
}

TEST_F(OneResultTest, OnOneCore) {
  const OneCore one_core;
  Flight flight(scenario("figure_eight"));
  expect_same(flight);
}

TEST_F(OneResultTest, WithEveryCoreBusy) {
  const Load load(std::thread::hardware_concurrency());
  Flight flight(scenario("figure_eight"));
  expect_same(flight);
}

TEST_F(OneResultTest, WithFivePercentOfAllDatagramsLost) {
  setenv("LD_PRELOAD", SLS_DROP_SHIM, 1);
  setenv("SLS_DROP_PERCENT", "5", 1);
  setenv("SLS_DROP_SEED", "1", 1);
  Flight flight(scenario("figure_eight"), {qos("udp"), {}, {}});
  for (const char* name : {"LD_PRELOAD", "SLS_DROP_PERCENT", "SLS_DROP_SEED"}) unsetenv(name);
  expect_same(flight);
  const auto at = flight.server->output().find("drop_shim: lost ");
  ASSERT_NE(at, std::string::npos) << "the shim was not loaded: " << flight.server->output();
  EXPECT_GT(std::stoi(flight.server->output().substr(at + 16)), 100) << flight.server->output();
}

/// Eight laps: even on the fastest machine the flight must not end before the test has read the
/// first steps.
std::string make_long_scenario(const TemporaryFolder& folder, const std::string& controllers) {
  return make_scenario(
      folder, {{"for_s: 32", "for_s: 128"}, {"controllers: 1", "controllers: " + controllers}},
      "figure_eight");
}

/// Certificate of the flight of `file` in one process.
std::string fly_in_process(const std::string& file, const TemporaryFolder& folder) {
  Process flight({program("closed_loop"), "--scenario", file, "--out", folder / "in-process"});
  EXPECT_EQ(flight.wait(), 0) << flight.output();
  return read_certificate(folder / "in-process");
}

TEST_F(OneResultTest, PausedSteppedAndResumed) {
  const TemporaryFolder folder;
  const std::string file = make_long_scenario(folder, "1");
  Flight flight(file);
  const auto control = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {program("sim_ctl"), "--domain", flight.domain.text()});
    Process process(words);
    EXPECT_EQ(process.wait(), 0) << process.output() << flight.outputs();
  };
  ASSERT_TRUE(flight.wait_for_steps(300)) << flight.outputs();
  flight.client->send(SIGSTOP);  // holds the flight until sim_ctl has joined
  control({"pause"});
  flight.client->send(SIGCONT);
  for (const char* steps : {"1", "1", "250"}) control({"step", steps});
  control({"resume"});
  flight.expect_success();
  EXPECT_EQ(read_certificate(flight.recording()), fly_in_process(file, folder));
}

TEST_F(OneResultTest, WithThePrimaryKilled) {
  const TemporaryFolder folder;
  const std::string file = make_long_scenario(folder, "2");
  Flight flight(file, {{}, {}, {"--name", "primary", "--strength", "2"}});
  Process standby(make_command("control_client", flight.domain.number(),
                               {"--scenario", file, "--name", "standby", "--strength", "1"}));
  ASSERT_TRUE(flight.wait_for_steps(500)) << flight.outputs() << standby.output();
  flight.client->kill();
  EXPECT_EQ(flight.server->wait(), 0) << flight.outputs();
  EXPECT_EQ(standby.wait(), 0) << standby.output();
  EXPECT_EQ(flight.recorder->wait(), 0) << flight.outputs();
  EXPECT_EQ(read_certificate(flight.recording()), fly_in_process(file, folder));
}

// --- sensing -------------------------------------------------------------------------------------

/// `figure_eight` with late answers and with sensor periods that are no multiples of the plant step
/// or the control period.
std::string make_sensed_scenario(const TemporaryFolder& folder, const std::string& controllers) {
  return make_scenario(
      folder,
      {{"mission:",
        "sensing:\n"
        "  period_s: 0.033333333\n"
        "  age_s: 0.02\n"
        "  rod: { period_s: 0.02, age_s: 0.011000001 }\n"
        "  node_delay_s: 0.0105\n"
        "estimator: { position_m: [0.02, -0.01, 0.03], velocity_m_s: [0, 0.01, 0] }\n"
        "mission:"},
       {"controllers: 1", "controllers: " + controllers}},
      "figure_eight");
}

TEST(SensingSystemTest, HasOneResultInProcessOverUdpAndWithThePrimaryKilled) {
  TemporaryFolder folder, other_folder;
  const std::string file = make_sensed_scenario(folder, "1");
  const std::filesystem::path in_process = folder / "in_process";
  Process alone({program("closed_loop"), "--scenario", file, "--out", in_process});
  EXPECT_EQ(alone.wait(), 0) << alone.output();
  Process checked({program("closed_loop"), "--scenario", file, "--check-purity"});
  EXPECT_EQ(checked.wait(), 0) << checked.output();
  const std::string certificate = read_certificate(in_process);

  Flight flight(file, {qos("udp"), {}, {}});
  flight.expect_success();
  EXPECT_EQ(read_certificate(flight.recording()), certificate);
  for (const char* name : {"state.csv", "measured.csv", "reference.csv"})
    EXPECT_EQ(read_file(in_process / name), read_file(flight.recording() / name)) << name;
  const Table truth(in_process / "state.csv"), seen(in_process / "measured.csv");
  ASSERT_EQ(seen.rows(), truth.rows());
  EXPECT_GT((seen.position(500, "quad") - truth.position(500, "quad")).norm(), 1e-3);

  const std::string file_of_two = make_sensed_scenario(other_folder, "2");
  Flight pair(file_of_two, {{}, {}, {"--name", "primary", "--strength", "2"}});
  Process standby(
      make_command("control_client", pair.domain.number(),
                   {"--scenario", file_of_two, "--name", "standby", "--strength", "1"}));
  ASSERT_TRUE(pair.wait_for_steps(500)) << pair.outputs() << standby.output();
  pair.client->kill();
  EXPECT_EQ(pair.server->wait(), 0) << pair.outputs();
  EXPECT_EQ(standby.wait(), 0) << standby.output();
  EXPECT_EQ(pair.recorder->wait(), 0) << pair.outputs();
  EXPECT_EQ(read_certificate(pair.recording()), certificate);
}

TEST(SensingSystemTest, AFleetHasTheSameResultInProcess) {
  TemporaryFolder folder;
  const std::string file = make_scenario(
      folder,
      {{"mission:", "sensing: { period_s: 0.007, age_s: 0.0033, node_delay_s: 0.0015 }\nmission:"}},
      "mixed_fleet");
  Process alone({program("closed_loop"), "--scenario", file, "--out", folder / "in_process"});
  EXPECT_EQ(alone.wait(), 0) << alone.output();
  Flight flight(file);
  flight.expect_success();
  EXPECT_EQ(read_certificate(flight.recording()), read_certificate(folder / "in_process"));
  EXPECT_EQ(read_file(flight.recording() / "measured.csv"),
            read_file(folder / "in_process/measured.csv"));
}

// --- faults in simulation time -------------------------------------------------------------------

TEST(FaultLineSystemTest, AFaultyFlightRepeatsAndEqualsTheOneInProcess) {
  Flight first(scenario("faulty_figure_eight")), second(scenario("faulty_figure_eight"));
  first.expect_success();
  second.expect_success();
  EXPECT_EQ(read_certificate(first.recording()), read_certificate(second.recording()));
  const auto flown = closed_loop::fly(config::load_scenario(scenario("faulty_figure_eight")));
  const Table states(first.recording() / "state.csv"), commands(first.recording() / "command.csv");
  ASSERT_EQ(states.rows(), flown.size());
  for (std::size_t row = 0; row < flown.size(); ++row) {
    const model::StepRecord& step = flown[row];
    ASSERT_EQ(states.position(row, "quad"), step.truth.p_WQ) << row;
    ASSERT_EQ(states.position(row, "load"), step.truth.p_WL) << row;
    ASSERT_EQ(states.number(row, "force_z_n"), step.f_Q_W.z()) << row;
    ASSERT_EQ(commands.number(row, "force_z_n"), step.answer.f_Q_W.z()) << row;
  }
}

}  // namespace
}  // namespace sls::test
