// The program closed_loop: the same data and certificate as the three programs, and its errors.
#include <gtest/gtest.h>

#include <csignal>

#include "tests/support/text.hpp"
#include "tests/support/waiting.hpp"
#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

std::vector<std::string> fly_in_process(const std::string& file,
                                        const std::filesystem::path& folder,
                                        std::vector<std::string> flags = {}) {
  flags.insert(flags.begin(), {program("closed_loop"), "--scenario", file, "--out", folder});
  return flags;
}

class ClosedLoopProgramTest : public ::testing::TestWithParam<const char*> {};

TEST_P(ClosedLoopProgramTest, RecordsTheFilesAndTheCertificateOfTheThreePrograms) {
  Flight flight(scenario(GetParam()));
  const std::filesystem::path folder = flight.folder / "in_process";
  Process alone(fly_in_process(scenario(GetParam()), folder));
  EXPECT_EQ(alone.wait(), 0) << alone.output();
  flight.expect_success();

  const auto together = read_manifest(flight.recording()), apart = read_manifest(folder);
  EXPECT_TRUE(apart.at("complete").get<bool>());
  EXPECT_EQ(apart.at("certificate"), together.at("certificate"));
  for (const char* key : {"outcome", "timing", "last_step", "scenario_sha256", "period_s", "mode"})
    EXPECT_EQ(apart.at(key), together.at(key)) << key;
  for (const char* name :
       {"state.csv", "measured.csv", "reference.csv", "flight.csv", "scenario.yaml"})
    EXPECT_EQ(read_file(folder / name), read_file(flight.recording() / name)) << name;
  const Table ours(folder / "command.csv"), theirs(flight.recording() / "command.csv");
  EXPECT_EQ(ours.names(), theirs.names());
  EXPECT_EQ(ours.rows(), theirs.rows());
  Process verify({program("sls_verify"), folder, flight.recording()});
  EXPECT_EQ(verify.wait(), 0) << verify.output();
}

// A fleet with stages that end within a radius; faults; another law; a multirotor with sensors.
INSTANTIATE_TEST_SUITE_P(Scenarios, ClosedLoopProgramTest,
                         ::testing::Values("mixed_fleet", "faulty_figure_eight", "figure_eight_pid",
                                           "px4_published"),
                         [](const auto& flown) { return std::string(flown.param); });

// 11 ms and 182 of them have no exact double: times are printed with the digits that they have.
TEST(ClosedLoopTimesTest, TimesArePrintedWithoutRoundingErrors) {
  TemporaryFolder folder;
  const std::string file = make_scenario(
      folder, {{"period_s: 0.004", "period_s: 0.011"}, {"for_s: 2", "for_s: 2.002"}}, "short");
  Flight flight(file);
  flight.expect_success();
  EXPECT_TRUE(holds(flight.server->output(), "period 0.011 s, step 0.001 s\n"));
  EXPECT_TRUE(holds(flight.server->output(), "finished: 182 steps, 2.002 s simulated in "));
  Process alone(fly_in_process(file, folder / "recording"));
  EXPECT_EQ(alone.wait(), 0) << alone.output();
  EXPECT_TRUE(holds(alone.output(), "finished: 182 steps, 2.002 s simulated in "))
      << alone.output();
}

TEST(ClosedLoopErrorsTest, AFlightThatFailsSaysWhyAndItsRecordingIsNotComplete) {
  TemporaryFolder folder;
  const std::string file =
      make_scenario(folder, {{"force_limit_n: 200", "force_limit_n: 10"}}, "figure_eight");
  Process alone(fly_in_process(file, folder / "recording"));
  EXPECT_EQ(alone.wait(), 1) << alone.output();
  EXPECT_TRUE(holds(alone.output(),
                    "error: step 0: controller 'control_client' answered step 0 with a force "
                    "beyond controller.force_limit_n: "))
      << alone.output();
  const auto manifest = read_manifest(folder / "recording");
  EXPECT_FALSE(manifest.at("complete").get<bool>());
  EXPECT_EQ(manifest.at("outcome"), "failed");
}

TEST(ClosedLoopErrorsTest, AnInterruptedFlightClosesItsFiles) {
  TemporaryFolder folder;
  const std::string file = make_scenario(folder, {{"for_s: 32", "for_s: 100000"}}, "figure_eight");
  Process alone(fly_in_process(file, folder / "recording"));
  ASSERT_TRUE(wait_until([&] { return std::filesystem::exists(folder / "recording/state.csv"); }));
  alone.send(SIGINT);
  EXPECT_EQ(alone.wait(), 130) << alone.output();
  const auto manifest = read_manifest(folder / "recording");
  EXPECT_EQ(manifest.at("outcome"), "interrupted");
  EXPECT_FALSE(manifest.at("complete").get<bool>());
  EXPECT_TRUE(Table(folder / "recording/state.csv").is_well_formed());
}

TEST(ClosedLoopErrorsTest, AFlightOfWhichAllCablesGoSlackFliesOnAndSaysSo) {
  // Each vehicle dives faster than its end of the load falls.
  std::string dives = "faults:\n";
  for (const char* id : {"0", "1", "2"})
    dives += std::string("  - bias: { on: command, vehicle: ") + id +
             ", force_n: [0, 0, 30], from_s: 0.5, to_s: 0.6 }\n";
  TemporaryFolder folder;
  const std::string file =
      make_scenario(folder,
                    {{"force_limit_n: 200", "force_limit_n: 200\n  retaut_rate_m_s: 0.5"},
                     {"mission:", dives + "mission:"}},
                    "three_carry_a_triangle");
  Process alone({program("closed_loop"), "--scenario", file});
  EXPECT_EQ(alone.wait(), 0) << alone.output();
  for (const char* text :
       {"warning: vehicle 2: cable slack at 0.500000000 s; no cable carries the load\n",
        "warning: vehicle 2: cable taut at ", "finished: 6500 steps"})
    EXPECT_TRUE(holds(alone.output(), text)) << alone.output();
}

TEST(ClosedLoopErrorsTest, AFullDiskLeavesNoFolder) {
  TemporaryFolder folder;
  Process flight({"/bin/sh", "-c",
                  "{ trap '' XFSZ; ulimit -f 0; \"$0\" \"$@\" 2>&1; echo \"code $?\"; } | cat",
                  program("closed_loop"), "--scenario", scenario("short"), "--out",
                  folder / "recording"});
  flight.wait();
  EXPECT_TRUE(holds(flight.output(), "cannot write: File too large\ncode 1\n")) << flight.output();
  EXPECT_FALSE(std::filesystem::exists(folder / "recording"));
}

}  // namespace
}  // namespace sls::test
