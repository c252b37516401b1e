// The program as a user calls it.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tests/support/waiting.hpp"
#include "tests/system/process.hpp"

namespace sls::test {
namespace {

std::vector<std::string> program_with(const std::vector<std::string>& words) {
  std::vector<std::string> command = {program("sls_worlds")};
  command.insert(command.end(), words.begin(), words.end());
  return command;
}

void expect_refused(const std::vector<std::string>& words, const std::string& cause) {
  Process process(program_with(words));
  EXPECT_EQ(process.wait(), 2) << process.output();
  const std::string output = process.output();
  EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 1) << output;
  EXPECT_NE(output.find(cause), std::string::npos) << output;
}

TEST(WorldsProgramTest, MistakesGiveOneLineAndExitCodeTwo) {
  for (const char* seeds : {"x", "5-2", "1-", "-1", "1-2-3", "99999999999999999999"})
    expect_refused({std::string("--seeds=") + seeds}, "--seeds: expected A-B");
  expect_refused({"--jobs", "0"}, "--jobs");
  expect_refused({"--verbose"}, "--replay");
  expect_refused({"--scenario", "no_such.yaml"}, "no_such.yaml");
  const TemporaryFolder folder;
  std::ifstream given(scenario("short"));
  std::string text(std::istreambuf_iterator<char>(given), {});
  text.replace(text.find("force_limit_n: 200"), 18, "force_limit_n: 16");
  std::ofstream(folder / "weak.yaml") << text;
  expect_refused({"--scenario", folder / "weak.yaml"}, "expected a flight that finishes");
  expect_refused({"--nonsense"}, "--nonsense");
  expect_refused({"--faults", "no_such.yaml"}, "no_such.yaml: expected a file of faults");
  std::ofstream(folder / "mtu.yaml") << "link: { mtu_bytes: 576 }\n";
  expect_refused({"--faults", folder / "mtu.yaml"},
                 "mtu.yaml:1: link.mtu_bytes: expected what worlds can do");
}

TEST(WorldsProgramTest, EveryWorldHasTheFaultsOfAFile) {
  Process process(program_with(
      {"--seeds", "0-39", "--faults", SLS_SOURCE_DIR "/config/faults/crash_and_cut.yaml"}));
  EXPECT_EQ(process.wait(), 0) << process.output();
  EXPECT_NE(process.output().find("worlds with a fault: kill 40, partition 40;"), std::string::npos)
      << process.output();
}

TEST(WorldsProgramTest, AReplayTellsTheWorldOfItsSeed) {
  Process process(program_with({"--replay", "7"}));
  EXPECT_EQ(process.wait(), 0) << process.output();
  const std::string output = process.output();
  EXPECT_EQ(output.find("  seed 7: "), 0u) << output;
  EXPECT_LE(std::count(output.begin(), output.end(), '\n'), 40) << output;
}

TEST(WorldsProgramTest, AnInterruptedSearchPrintsItsResultAndLeavesNothing) {
  Process process(program_with({"--seeds", "0-99999999"}));
  ASSERT_TRUE(wait_until([&] { return process.output().find(" worlds/s") != std::string::npos; }))
      << process.output();
  const std::filesystem::path folder = "/dev/shm/sls_worlds_" + std::to_string(process.id());
  EXPECT_TRUE(std::filesystem::exists(folder));
  process.send(SIGINT);
  EXPECT_EQ(process.wait(), 130) << process.output();
  EXPECT_NE(process.output().find(" worlds, 0 failed; "), std::string::npos) << process.output();
  EXPECT_FALSE(std::filesystem::exists(folder));
}

}  // namespace
}  // namespace sls::test
