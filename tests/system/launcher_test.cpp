/// `./sls run` as a user calls it.
#include <dirent.h>
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;

std::string launcher() { return std::string(SLS_SOURCE_DIR) + "/sls"; }

/// True while a process runs that has `text` in its command line.
bool is_anyone_running(const std::string& text) {
  for (const auto& entry : fs::directory_iterator("/proc")) {
    std::string command = read_file(entry.path() / "cmdline");
    for (char& letter : command)
      if (letter == '\0') letter = ' ';
    if (command.find(text) != std::string::npos && command.find("/bin/") != std::string::npos)
      return true;
  }
  return false;
}

class LauncherTest : public ::testing::Test {
 protected:
  LauncherTest() { setenv("SLS_BUILD", SLS_BUILD_DIR, 1); }
  std::vector<std::string> run_command(const std::string& what) const {
    return {launcher(), "run", what, "--domain", domain.text(), "--out", recording()};
  }
  std::string recording() const { return folder / "recording"; }
  TemporaryFolder folder;
  OwnDomain domain;
};

TEST_F(LauncherTest, RunTakesPathsPeriodsAndQosFiles) {
  auto command = run_command(scenario("short"));
  command.insert(command.end(), {"--period-s", "0.002", "--qos", qos("udp")});
  Process run(command);
  EXPECT_EQ(run.wait(), 0) << run.output();
  EXPECT_EQ(Table(recording() + "/state.csv").rows(), 1001u);
  EXPECT_EQ(read_manifest(recording()).at("period_s"), 0.002);
}

TEST_F(LauncherTest, MistakesEndWithTwoAndOneLine) {
  const auto refuse = [](const std::vector<std::string>& command, const std::string& cause) {
    Process run(command);
    EXPECT_EQ(run.wait(), 2) << run.output();
    EXPECT_NE(run.output().find(cause), std::string::npos) << run.output();
    const std::string output = run.output();
    EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 1) << output;
  };
  refuse(run_command("no_such_scenario"), "no_such_scenario.yaml");
  refuse({launcher(), "run"}, "expected a scenario");
  refuse({launcher(), "run", "short", "--nonsense"}, "--nonsense");
  auto command = run_command("short");
  command.insert(command.end(), {"--domain", "300"});
  refuse(command, "--domain");
  fs::create_directory(recording());
  write_bytes(recording() + "/notes.txt", "mine");
  refuse(run_command("short"), "'notes.txt'");
}

TEST_F(LauncherTest, AnInterruptedOrKilledLauncherLeavesNoProcessBehind) {
  const std::pair<int, int> cases[] = {{SIGINT, 130}, {SIGTERM, 143}, {SIGKILL, 137}};
  for (const auto& [signal, code] : cases) {
    SCOPED_TRACE(signal);
    fs::remove_all(recording());
    Process run(run_command("mission"));
    ASSERT_TRUE(wait_until([&] {
      return fs::exists(recording() + "/state.csv") &&
             fs::file_size(recording() + "/state.csv") > 100000;
    })) << run.output();
    run.send(signal);
    EXPECT_EQ(run.wait(), code) << run.output();
    EXPECT_TRUE(wait_until([&] { return !is_anyone_running(recording()); }));
    EXPECT_TRUE(wait_until([&] { return !is_anyone_running("--domain " + domain.text() + " "); }));
    EXPECT_TRUE(Table(recording() + "/state.csv").is_well_formed());
    EXPECT_FALSE(read_manifest(recording()).at("complete").get<bool>());
  }
}

TEST_F(LauncherTest, AProcessThatDiesEndsTheRunWithOne) {
  Process run(run_command("mission"));
  ASSERT_TRUE(wait_until([&] {
    return fs::exists(recording() + "/state.csv") &&
           fs::file_size(recording() + "/state.csv") > 100000;
  })) << run.output();
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string command = read_file(entry.path() / "cmdline");
    if (command.find("/control_client") == std::string::npos) continue;
    const auto parent = read_file(entry.path() / "status");
    if (parent.find("PPid:\t" + std::to_string(run.id()) + "\n") == std::string::npos) continue;
    kill_process(std::stoi(entry.path().filename().string()));
  }
  EXPECT_EQ(run.wait(), 1) << run.output();
  EXPECT_NE(run.output().find("control_client ended with 137"), std::string::npos) << run.output();
  EXPECT_FALSE(is_anyone_running(recording()));
}

}  // namespace
}  // namespace sls::test
