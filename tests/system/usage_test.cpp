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

Words server_with(const Words& flags) { return Words{program("sim_server")} + flags; }

TEST(UsageTest, EveryProgramPrintsHelpWithDefaultsAndItsVersion) {
  for (const char* name : {"sim_server", "control_client", "recorder"}) {
    const std::string help = expect_exit({program(name), "--help"});
    for (const char* flag : {"--qos", "--domain", "--log-level", "--version", "info"})
      EXPECT_TRUE(holds(help, flag)) << name << " " << flag << help;
    EXPECT_TRUE(std::regex_match(expect_exit({program(name), "--version"}),
                                 std::regex("sls \\d+\\.\\d+\\.\\d+\n")));
  }
}

TEST(UsageTest, WrongFlagsAreRefused) {
  expect_refused({program("sim_server")}, 2, "--scenario is required");
  expect_refused({program("recorder")}, 2, "--out is required");
  expect_refused(server_with({"--scenario", scenario("short"), "--nonsense"}), 2, "--nonsense");
  for (const char* name : {"sim_server", "control_client"})
    for (const char* domain : {"233", "-1", "one"})
      expect_refused({program(name), "--scenario", scenario("short"), "--domain", domain}, 2,
                     "--domain");
  expect_refused(
      {"/usr/bin/env", "SLS_DOMAIN=233", program("sim_server"), "--scenario", scenario("short")}, 2,
      "SLS_DOMAIN: expected 0 to 232, got '233'");
  expect_refused(server_with({"--scenario", scenario("short"), "--period-s", "0.0035"}), 2,
                 "--period-s");
  expect_refused(server_with({"--scenario", scenario("short"), "--period-s", "nan"}), 2,
                 "--period-s");
  expect_refused({program("control_client"), "--scenario", scenario("short"), "--name", "a,b"}, 2,
                 "--name");
  expect_refused(server_with({"--scenario", scenario("short"), "--mode", "fast"}), 2, "--mode");
  expect_refused(server_with({"--scenario", scenario("short"), "--rtf", "2"}), 2,
                 "--rtf: expected --mode realtime with it");
  for (const char* factor : {"0", "-1", "nan", "inf", "1001"})
    expect_refused(
        server_with({"--scenario", scenario("short"), "--mode", "realtime", "--rtf", factor}), 2,
        "--rtf");
}

TEST(UsageTest, OperatorAndVerifierRefuseImpossibleRequests) {
  TemporaryFolder folder;
  expect_refused({program("sim_ctl")}, 2, "");
  expect_refused({program("sim_ctl"), "fly"}, 2,
                 "expected pause, step, resume, start, reset, stop or status, got 'fly'");
  expect_refused({program("sim_ctl"), "step", "0"}, 2, "0");
  expect_refused({program("sls_verify")}, 2, "");
  expect_refused({program("sls_verify"), folder / "none"}, 2, "none");
  expect_refused({program("sls_verify"), folder.path()}, 2, "manifest.json");
}

TEST(UsageTest, UnusableScenariosAreRefusedByServerAndClient) {
  TemporaryFolder folder;
  write_bytes(folder / "empty.yaml", "");
  fs::create_directory(folder / "folder.yaml");
  write_bytes(folder / "misspelt.yaml",
              replace_once(read_file(scenario("short")), "load_mass_kg", "laod_mass_kg"));
  write_bytes(folder / "negative.yaml", replace_once(read_file(scenario("short")),
                                                     "load_mass_kg: 0.2", "load_mass_kg: -0.16"));
  write_bytes(folder / "huge.yaml", "");
  fs::resize_file(folder / "huge.yaml", 100'000'000);
  for (const char* name : {"sim_server", "control_client"}) {
    const auto refuse = [&](const std::string& file, const std::string& cause) {
      expect_refused({program(name), "--scenario", file}, 2, cause);
    };
    refuse(folder / "none.yaml", "none.yaml: ");
    refuse(folder / "empty.yaml", "empty.yaml: ");
    refuse(folder / "folder.yaml", "folder.yaml: ");
    refuse(folder / "huge.yaml", "100000000");
    refuse(folder / "misspelt.yaml", "misspelt.yaml:3: vehicle.laod_mass_kg: unknown key");
    refuse(folder / "negative.yaml",
           "negative.yaml:3: vehicle.load_mass_kg: expected > 0, got -0.16");
  }
}

TEST(UsageTest, UnusableQosFilesAreRefusedByEveryProgram) {
  TemporaryFolder folder;
  const std::string shipped = read_file(qos("default"));
  write_bytes(folder / "malformed.xml", shipped.substr(0, shipped.size() / 2));
  const std::string endpoints = read_file(qos("endpoints"));
  const std::string whole = replace_once(
      shipped, "</profiles>",
      endpoints.substr(endpoints.find("<data_writer"),
                       endpoints.rfind("</profiles>") - endpoints.find("<data_writer")) +
          "</profiles>");
  write_bytes(folder / "misnamed.xml", replace_once(whole, "\"sls_loop_reader\"", "\"sls_lop\""));
  write_bytes(folder / "refused.xml",
              replace_once(whole, "<depth>150</depth>", "<depth>many</depth>"));
  int run_number = 0;
  for (const char* name : {"sim_server", "control_client", "recorder"}) {
    const auto refuse = [&](const std::string& file, const std::string& cause) {
      const bool records = std::string(name) == "recorder";
      const std::string out = folder / ("recording" + std::to_string(run_number++));
      expect_refused(Words{program(name), "--qos", file} +
                         (records ? Words{"--out", out} : Words{"--scenario", scenario("short")}),
                     2, cause);
    };
    refuse(folder / "none.xml", "none.xml: ");
    refuse(folder.path(), "got a directory");
    refuse(folder / "malformed.xml", "malformed.xml:");
    refuse(folder / "misnamed.xml", "profile 'sls_lop'");
    refuse(folder / "refused.xml", "refused.xml: ");
  }
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

TEST(UsageTest, TooLittleSharedMemoryIsNamedBeforeTheFirstSample) {
  if (geteuid() != 0) GTEST_SKIP() << "skipped: only root can mount another /dev/shm";
  const TemporaryFolder folder;
  const Words limited = {"/usr/bin/unshare", "--mount", "sh", "-c",
                         "mount -t tmpfs -o size=1m tmpfs /dev/shm && exec \"$0\" \"$@\""};
  for (const Words& command : {server_with({"--scenario", scenario("short")}),
                               {program("control_client"), "--scenario", scenario("short")},
                               {program("recorder"), "--out", folder / "recording"}})
    expect_refused(limited + command, 1,
                   "/dev/shm: expected 10.7 MB free, got 1.0 MB: mount -o remount,size=64M");
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
  EXPECT_TRUE(server.is_running());
  server.send(SIGTERM);
  EXPECT_EQ(server.wait(), 143);
}

}  // namespace
}  // namespace sls::test
