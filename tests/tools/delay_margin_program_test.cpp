// The program and `./sls delay-margin` as a user calls them.
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>

#include "tests/system/process.hpp"

namespace sls::test {
namespace {

void expect_refused(const Words& command, int exit_code, const std::string& cause) {
  const std::string output = expect_exit(command, exit_code);
  EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 1) << output;
  EXPECT_NE(output.find("error: "), std::string::npos) << output;
  EXPECT_NE(output.find(cause), std::string::npos) << output;
}

std::string launcher() { return std::string(SLS_SOURCE_DIR) + "/sls"; }

Words program_with(const Words& flags) { return Words{program("delay_margin")} + flags; }

TEST(DelayMarginProgramTest, PrintsATableAndTheMarginTheSameEveryTime) {
  const auto command = program_with({"--scenario", scenario("matlab_setpoint_3")});
  const std::string output = expect_exit(command);
  const std::regex table(
      "delay \\(s\\) +periods +worst error \\(m\\) +rms error \\(m\\) +outcome\n"
      "( +[0-9.]+ +[0-9]+ +[0-9.]+ +[0-9.]+  (held|lost: .+, at [0-9.]+ s)\n)+"
      "holds with [0-9.]+ s, loses the load with [0-9.]+ s\n");
  EXPECT_TRUE(std::regex_match(output, table)) << output;
  EXPECT_EQ(expect_exit(command), output);
}

TEST(DelayMarginProgramTest, TheLauncherTakesNamesPathsAndPeriods) {
  setenv("SLS_BUILD", SLS_BUILD_DIR, 1);
  const std::string by_name = expect_exit({launcher(), "delay-margin", "short"}, 0);
  EXPECT_EQ(expect_exit({launcher(), "delay-margin", scenario("short")}, 0), by_name);
  const std::string at_8_ms =
      expect_exit({launcher(), "delay-margin", "short", "--period-s", "0.008"}, 0);
  EXPECT_NE(at_8_ms.find("\n    0.008        1 "), std::string::npos) << at_8_ms;
  expect_refused({launcher(), "delay-margin"}, 2, "expected a scenario");
  expect_refused({launcher(), "delay-margin", "short", "setpoints"}, 2, "expected one scenario");
  expect_refused({launcher(), "delay-margin", "short", "--nonsense"}, 2, "--nonsense");
  expect_refused({launcher(), "delay-margin", "short", "--period-s"}, 2, "expected a value");
  expect_refused({launcher(), "delay-margin", "no_such"}, 2, "no_such.yaml");
}

TEST(DelayMarginProgramTest, MistakesGiveOneLineAndExitCodeTwo) {
  expect_refused(program_with({}), 2, "--scenario is required");
  expect_refused(program_with({"--scenario", scenario("short"), "--domain", "3"}), 2, "--domain");
  expect_refused(program_with({"--scenario", "none.yaml"}), 2, "none.yaml: ");
  expect_refused(program_with({"--scenario", scenario("short"), "--period-s", "0.0035"}), 2,
                 "--period-s");
  expect_refused(program_with({"--scenario", scenario("short"), "--vehicle", "1"}), 2,
                 "--vehicle: expected one of short, 0 to 0, got 1");
  const TemporaryFolder folder;
  const std::string file = folder / "negative.yaml";
  write_bytes(file,
              "faults: [{ delay: { on: command, by_s: -0.02 } }]\n" + read_file(scenario("short")));
  expect_refused(program_with({"--scenario", file}), 2,
                 "negative.yaml:1: faults[0].delay.by_s: expected >= 0, got -0.02");
}

TEST(DelayMarginProgramTest, AScenarioThatLosesTheLoadAnywayEndsWithOne) {
  const TemporaryFolder folder;
  const std::string file = folder / "weak.yaml";
  write_bytes(file, replace_once(read_file(scenario("matlab_setpoint_3")), "force_limit_n: 200",
                                 "force_limit_n: 100"));
  expect_refused(program_with({"--scenario", file}), 1,
                 "the load is lost without any added delay: controller 'control_client' answered "
                 "step 0 with a force "
                 "beyond");
}

}  // namespace
}  // namespace sls::test
