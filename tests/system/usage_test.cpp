/// Bad input to the real programs: one clear line, the documented exit code, no files left behind.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <regex>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;

/// Expects one line that begins with the program's name and "error:" and contains `cause`.
void expect_refused(const Words& command, int exit_code, const std::string& cause) {
  const std::string said = expect_exit(command, exit_code);
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
  EXPECT_TRUE(std::regex_search(said, std::regex("^[a-z_]+: error: "))) << said;
  EXPECT_TRUE(holds(said, cause)) << "expected '" << cause << "' in: " << said;
}

/// One mistake of each kind in each program. CLI, readers and their messages: RunMainTest,
/// InvalidScenariosTest, QosFileTest, VehicleIdsTest.
TEST(UsageTest, MistakesAreRefused) {
  TemporaryFolder folder;
  const std::string flown = scenario("short");
  write_bytes(folder / "misspelt.yaml",
              replace_once(read_file(flown), "load_mass_kg", "laod_mass_kg"));
  write_bytes(folder / "malformed.xml", read_file(qos("default")).substr(0, 500));
  const auto refuse = [](const char* name, const Words& flags, const std::string& cause) {
    expect_refused(Words{program(name)} + flags, 2, cause);
  };
  refuse("sim_server", {}, "--scenario is required");
  refuse("recorder", {}, "--out is required");
  refuse("recorder", {"--out", folder / "recording", "--qos", folder / "malformed.xml"},
         "malformed.xml:");
  for (const char* name : {"sim_server", "control_client"}) {
    const auto refuse_flags = [&](const Words& flags, const std::string& cause) {
      refuse(name, Words{"--scenario", flown} + flags, cause);
    };
    refuse(name, {"--scenario", folder / "misspelt.yaml"},
           "misspelt.yaml:3: vehicle.laod_mass_kg: unknown key");
    refuse_flags({"--qos", folder / "malformed.xml"}, "malformed.xml:");
    refuse_flags({"--domain", "233"}, "--domain");
    refuse_flags({"--vehicles", "1"},
                 "--vehicles: expected 0, the scenario's only vehicle, got '1'");
  }
  refuse("control_client", {"--scenario", flown, "--name", "a,b"}, "--name");
  const auto refuse_flags = [&](const Words& flags, const std::string& cause) {
    refuse("sim_server", Words{"--scenario", flown} + flags, cause);
  };
  refuse_flags({"--period-s", "0.0035"}, "--period-s");
  refuse_flags({"--mode", "fast"}, "--mode");
  refuse_flags({"--rtf", "2"}, "--rtf: expected --mode realtime with it");
  for (const char* factor : {"0", "-1", "nan", "inf", "1001"})
    refuse_flags({"--mode", "realtime", "--rtf", factor}, "--rtf");
  for (const char* threads : {"0", "-1", "two"}) refuse_flags({"--threads", threads}, "--threads");
  refuse("sim_ctl", {}, "");
  refuse("sim_ctl", {"fly"},
         "expected pause, step, resume, start, reset, stop or status, got 'fly'");
  refuse("sim_ctl", {"step", "0"}, "0");
  refuse("sls_verify", {}, "");
  refuse("sls_verify", {folder / "none"}, "none");
  refuse("sls_verify", {folder.path()}, "manifest.json");
}

TEST(UsageTest, RecorderRefusesAFolderThatIsNotEmptyAndReplacesARecordingWithForce) {
  TemporaryFolder folder;
  fs::create_directory(folder / "full");
  write_bytes(folder / "full/notes.txt", "mine");
  expect_refused({program("recorder"), "--out", folder / "full"}, 2, "'notes.txt'");
  expect_refused({program("recorder"), "--out", folder / "full", "--force"}, 2, "'notes.txt'");
  EXPECT_EQ(read_file(folder / "full/notes.txt"), "mine");
  expect_refused({program("recorder"), "--out", folder / "full/notes.txt"}, 2, "a file");
  expect_refused({program("recorder"), "--out", "/proc/sls"}, 2, "--out /proc/sls");

  fs::create_directory(folder / "old");
  write_bytes(folder / "old/state.csv", "old");
  expect_refused({program("recorder"), "--out", folder / "old", "--check"}, 2, "--force");
  EXPECT_EQ(read_file(folder / "old/state.csv"), "old");
  expect_exit({program("recorder"), "--out", folder / "old", "--force", "--check"});
  EXPECT_FALSE(fs::exists(folder / "old/state.csv"));
}

TEST(UsageTest, WhatAMachineLacksIsNamedBeforeTheFirstSample) {
  if (geteuid() != 0) GTEST_SKIP() << "skipped: only root can mount another /dev/shm";
  const TemporaryFolder folder;
  for (const auto& [change, words] :
       {std::pair("mount -t tmpfs -o size=1m tmpfs /dev/shm",
                  "/dev/shm: expected 10.7 MB free, got 1.0 MB: mount -o remount,size=64M"),
        std::pair("mount -t tmpfs -o ro tmpfs /dev/shm", "got 'Read-only file system': mount -t"),
        std::pair("ulimit -n 14", "(EMFILE): ulimit -n")})
    for (const Words& command : {Words{program("sim_server"), "--scenario", scenario("short")},
                                 {program("control_client"), "--scenario", scenario("short")},
                                 {program("recorder"), "--out", folder / "recording"}})
      expect_refused(Words{"/usr/bin/unshare", "--mount", "sh", "-c",
                           change + std::string(" && exec \"$0\" \"$@\"")} +
                         command,
                     1, words);
}

TEST(UsageTest, AVariableOfRosThatNamesADiscoveryServerChangesNothing) {
  FlightOptions options;
  for (const char* name : {"recorder", "sim_server", "control_client"})
    options.before[name] = {"env", "ROS_DISCOVERY_SERVER=127.0.0.1:9"};
  Flight(scenario("short"), options).expect_success();
}

TEST(UsageTest, ABusErrorIsExplainedBeforeItEndsTheProgram) {
  OwnDomain domain;
  Process server(
      make_command("sim_server", domain.number(), {"--scenario", scenario("short")}, qos("udp")));
  ASSERT_TRUE(wait_for_text(server, "waiting for: controller"));
  server.send(SIGBUS);
  EXPECT_EQ(server.wait(), 128 + SIGBUS);
  EXPECT_NE(server.output().find("error: SIGBUS: memory of a file is gone"), std::string::npos)
      << server.output();
}

TEST(UsageTest, ClientWithAnotherScenarioIsRefusedWithBothHashes) {
  TemporaryFolder folder;
  write_bytes(folder / "other.yaml", read_file(scenario("short")) + "# another byte\n");
  OwnDomain domain;
  Process server(make_command("sim_server", domain.number(), {"--scenario", scenario("short")}));
  Process client(
      make_command("control_client", domain.number(), {"--scenario", folder / "other.yaml"}));
  EXPECT_EQ(client.wait(), 2);
  const std::regex both("error: .*expected the server's, SHA-256 [0-9a-f]{64}, got [0-9a-f]{64}");
  EXPECT_TRUE(std::regex_search(client.output(), both)) << client.output();
  const std::regex flight("a flight of 'short' \\(\\w+, sim_server, process \\d+\\) is on domain " +
                          domain.text() + "; use --domain \\d+");
  EXPECT_TRUE(std::regex_search(client.output(), flight)) << client.output();
  Process stranger(
      Words{"setpriv", "--reuid", "65534", "--clear-groups"} +
      make_command("control_client", domain.number(), {"--scenario", scenario("short")}));
  EXPECT_NE(stranger.wait(), 0);
  if (geteuid() == 0 && !holds(stranger.output(), "failed to execute"))
    EXPECT_TRUE(std::regex_search(stranger.output(), flight)) << stranger.output();
  EXPECT_TRUE(server.is_running());
  server.send(SIGTERM);
  EXPECT_EQ(server.wait(), 143);
}

}  // namespace
}  // namespace sls::test
