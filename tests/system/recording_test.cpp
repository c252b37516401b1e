/// Files of the real recorder, and the real verifier's output for them.
#include <gtest/gtest.h>
#include <signal.h>

#include <map>
#include <sstream>
#include <utility>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;

/// Number of bytes a process has read from files. Also valid after its end, until it is waited for.
std::uint64_t count_reads(const Process& process) {
  const std::string counters = read_file("/proc/" + std::to_string(process.id()) + "/io");
  const std::string key = "rchar: ";
  return std::stoull(counters.substr(counters.find(key) + key.size()));
}

std::uint64_t count_bytes(const fs::path& folder) {
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) bytes += entry.file_size();
  return bytes;
}

class RecordingFilesTest : public ProgramsTest {};

// The files must not be read once for each of the 40 vehicles.
TEST_F(RecordingFilesTest, OfAFleetAreReadAFewTimesToResumeAndToVerifyHoweverManyVehiclesFly) {
  const std::string file = make_scenario(folder, {{"for_s: 2", "for_s: 8"}});
  write_bytes(file, read_file(file) + "vehicles: 40\n");
  auto recorder = start("recorder", {"--out", recording(), "--resume"});
  const auto server = start("sim_server", {"--scenario", file});
  const auto client = start("control_client", {"--scenario", file});
  ASSERT_TRUE(wait_until([&] { return read_file(recording() / "command.csv").size() > 300'000; }))
      << server->output();
  recorder->kill();
  std::uint64_t rows = 0;
  for (const char* name : {"state.csv", "command.csv", "reference.csv"})
    rows += fs::file_size(recording() / name);

  // Allowance for other files, such as settings: a recorder that finds no server reads 50 kB.
  constexpr std::uint64_t kStart = 1 << 20;
  recorder = start("recorder", {"--out", recording(), "--resume"});
  ASSERT_TRUE(wait_until([&] { return holds(recorder->output(), "segment-2, from step "); },
                         std::chrono::minutes(4)))
      << recorder->output();
  // Reads twice: to find the step to resume from, and for the certificate.
  EXPECT_LT(count_reads(*recorder), kStart + 3 * rows);
  for (Process* process : {recorder.get(), server.get(), client.get()}) {
    process->send(SIGTERM);
    EXPECT_TRUE(process->wait().has_value()) << process->output();
  }

  // Reads each of the two recordings three times: for checksums, certificate and comparison.
  Process verify({program("sls_verify"), recording(), recording()});
  ASSERT_TRUE(wait_until([&] { return find_state(verify.id()) == 'Z'; }, std::chrono::minutes(4)));
  EXPECT_LT(count_reads(verify), kStart + 6 * count_bytes(recording()));
  EXPECT_EQ(verify.wait(), 0) << verify.output();
}

// After a power cut, any part of the data not yet on the disk may be missing, also the renaming.
TEST_F(RecordingFilesTest, AreOnTheDiskBeforeTheManifestThatListsThem) {
  const std::string log = folder / "log";
  FlightOptions options;
  options.before["recorder"] = {"env", std::string("LD_PRELOAD=") + SLS_SYNC_SHIM,
                                "SLS_SYNC_LOG=" + log};
  Flight flight(scenario("short"), options);
  flight.expect_success();
  const std::string made = flight.recording();
  const std::string part = made + "/manifest.json.part", manifest = made + "/manifest.json";

  std::istringstream lines(read_file(log));
  std::map<std::string, std::uint64_t> synced;  // bytes per file since the last renaming
  std::map<std::string, std::uint64_t> before_the_last;
  int renamings = 0;
  for (std::string what, from, to; lines >> what >> from >> to;) {
    if (what == "sync") {
      synced[from] = std::stoull(to);
      continue;
    }
    ASSERT_EQ(from + ' ' + to, part + ' ' + manifest);
    EXPECT_EQ(synced.count(part), 1u) << "after renaming " << renamings;
    EXPECT_TRUE(renamings == 0 || synced.count(made) == 1) << "after renaming " << renamings;
    ++renamings;
    before_the_last = std::exchange(synced, {});
  }
  EXPECT_GE(renamings, 2) << "one when it begins, one at the end";
  EXPECT_EQ(synced.count(made), 1u);
  before_the_last[manifest] = before_the_last[part];
  const auto files = read_manifest(made).at("files");
  EXPECT_EQ(files.size(), 7u);
  for (const auto& entry : fs::directory_iterator(made))
    EXPECT_EQ(before_the_last[entry.path()], entry.file_size()) << entry.path();
}

TEST_F(RecordingFilesTest, WithoutAStepAreEqualToNothing) {
  const auto recorder = start("recorder", {"--out", recording()});
  const auto server = start("sim_server", {"--scenario", scenario("short")});  // waits for a client
  ASSERT_TRUE(wait_until([&] { return fs::exists(recording() / "manifest.json"); }))
      << recorder->output() << server->output();
  recorder->send(SIGTERM);
  server->send(SIGTERM);
  EXPECT_EQ(recorder->wait(), 143) << recorder->output();
  EXPECT_EQ(server->wait(), 143) << server->output();

  const std::string alone = expect_exit({program("sls_verify"), recording()});
  EXPECT_TRUE(holds(alone, "matches its manifest: 0 steps")) << alone;
  fs::copy(recording(), folder / "copy");
  const std::string both = expect_exit({program("sls_verify"), recording(), folder / "copy"}, 1);
  EXPECT_TRUE(holds(both, "neither A nor B holds a step")) << both;
}

}  // namespace
}  // namespace sls::test
