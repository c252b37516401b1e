/// Real failures during a flight: processes killed and interrupted, a full disk, a singular state.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <utility>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 5> kTables = {"state.csv", "command.csv", "reference.csv",
                                                "flight.csv", "status.csv"};

/// Every CSV file parses, and its rows are consecutive steps from 0.
void expect_parsable(const fs::path& recording) {
  for (const char* name : kTables) {
    SCOPED_TRACE(name);
    const Table table(recording / name);
    EXPECT_TRUE(table.is_well_formed());
    const std::string text = read_file(recording / name);
    ASSERT_FALSE(text.empty());
    EXPECT_EQ(text.back(), '\n');
  }
  const Table states(recording / "state.csv");
  for (std::size_t row = 0; row < states.rows(); ++row)
    ASSERT_EQ(states.number(row, "step"), static_cast<double>(row));
}

/// The scenario `base` with `from` replaced by `to`, and with short time limits.
std::string make_scenario(const TemporaryFolder& folder, const std::string& from,
                          const std::string& to, const std::string& base = "short") {
  std::vector<std::pair<std::string, std::string>> changes = {{"timeout_s: 30", "timeout_s: 4"}};
  if (!from.empty()) changes.emplace_back(from, to);
  return make_scenario(folder, changes, base);
}

TEST(FaultsTest, InterruptedProgramsCloseTheirFilesAndSayWhichSignal) {
  Flight flight(scenario("mission"));
  ASSERT_TRUE(flight.wait_for_steps(500)) << flight.outputs();
  const std::array<std::pair<Process*, int>, 3> sent = {{{flight.recorder.get(), SIGTERM},
                                                         {flight.server.get(), SIGINT},
                                                         {flight.client.get(), SIGTERM}}};
  for (const auto& [process, signal] : sent) process->send(signal);
  flight.wait();
  for (const auto& [process, signal] : sent)
    EXPECT_EQ(process->wait(), 128 + signal) << flight.outputs();
  expect_parsable(flight.recording());
  const auto manifest = read_manifest(flight.recording());
  EXPECT_FALSE(manifest.at("complete").get<bool>());
  EXPECT_TRUE(holds(manifest.at("reason"), "interrupted by SIG")) << manifest;  // of both
  EXPECT_TRUE(fs::exists(flight.recording() / "flight.txt"));
}

TEST(FaultsTest, KilledServerEndsClientAndRecorderWithItsAbsenceNamed) {
  TemporaryFolder folder;
  Flight flight(make_scenario(folder, "", "", "mission"));  // others wait 4 s for a server
  ASSERT_TRUE(flight.wait_for_steps(500)) << flight.outputs();
  flight.server->kill();
  EXPECT_EQ(flight.client->wait(), 1) << flight.outputs();
  EXPECT_TRUE(holds(flight.client->output(), "(silent for ")) << flight.client->output();
  EXPECT_EQ(flight.recorder->wait(), 1) << flight.outputs();
  EXPECT_TRUE(holds(flight.recorder->output(), "given up after 4 s")) << flight.recorder->output();
  expect_parsable(flight.recording());
  EXPECT_FALSE(read_manifest(flight.recording()).at("complete").get<bool>());
}

TEST(FaultsTest, SingularStateEndsTheRunWithItsFaultAndNoNaN) {
  TemporaryFolder folder;
  const std::string file = make_scenario(folder, "load_position_m: [0, 0, -0.5]",
                                         "load_position_m: [0, 0, -0.5], alpha_rad: 1.5707");
  Flight flight(file);
  flight.wait();
  EXPECT_EQ(flight.server->wait(), 1) << flight.outputs();
  EXPECT_EQ(flight.client->wait(), 1) << flight.outputs();
  EXPECT_EQ(flight.recorder->wait(), 1) << flight.outputs();
  EXPECT_TRUE(holds(flight.server->output(),
                    "controller 'control_client' answered step 0 with a fault: rod_level"))
      << flight.server->output();
  expect_parsable(flight.recording());
  const Table commands(flight.recording() / "command.csv");
  ASSERT_EQ(commands.rows(), 1u);
  EXPECT_EQ(commands.text(0, "fault"), "rod_level");
  EXPECT_EQ(commands.number(0, "force_z_n"), 0.0);
  for (const char* name : {"state.csv", "command.csv", "reference.csv", "flight.csv"})
    EXPECT_EQ(read_file(flight.recording() / name).find("nan"), std::string::npos) << name;
}

TEST(FaultsTest, AFullDiskEndsTheRecordingWithFileAndCauseAndNoFileLooksWhole) {
  TemporaryFolder folder;
  fs::create_directory(folder / "disk");
  const std::string disk = folder / "disk";
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=600k") != 0)
    GTEST_SKIP() << "skipped: a small disk needs the right to mount";
  struct Unmount {
    std::string path;
    ~Unmount() { umount2(path.c_str(), MNT_DETACH); }
  } unmount{disk};
  const std::string file = make_scenario(folder, "", "", "figure_eight");
  const Programs programs;
  const auto recorder = programs.start("recorder", {"--out", disk + "/recording"}),
             server = programs.start("sim_server", {"--scenario", file}),
             client = programs.start("control_client", {"--scenario", file});
  EXPECT_EQ(recorder->wait(), 1) << recorder->output();
  EXPECT_TRUE(holds(recorder->output(), "No space left on device")) << recorder->output();
  EXPECT_TRUE(holds(recorder->output(), ".csv: cannot write")) << recorder->output();
  EXPECT_EQ(server->wait(), 1) << server->output();
  EXPECT_TRUE(holds(server->output(), "recorder")) << server->output();
  EXPECT_EQ(client->wait(), 1) << client->output();
  expect_parsable(disk + "/recording");
  EXPECT_FALSE(read_manifest(disk + "/recording").at("complete").get<bool>());
}

}  // namespace
}  // namespace sls::test
