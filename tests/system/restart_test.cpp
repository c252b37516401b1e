/// Any process can be killed and restarted without a restart of the others.
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;

class RestartTest : public ProgramsTest {
 protected:
  std::unique_ptr<Process> start_server() const {
    return start("sim_server", {"--scenario", file_});
  }
  std::unique_ptr<Process> start_client(const Words& further = {}) const {
    return start("control_client", Words{"--scenario", file_} + further);
  }
  std::unique_ptr<Process> start_recorder(const Words& further = {}) const {
    return start("recorder", Words{"--out", recording()} + further);
  }
  /// Waits for whole steps: commands are flushed last.
  bool wait_for_rows() const {
    return wait_until([&] { return read_file(recording() / "command.csv").size() > 20'000; });
  }

  std::string file_ = make_long_scenario(folder);
};

TEST_F(RestartTest, AKilledClientAndAKilledRecorderGoOnAndTogetherNothingIsMissing) {
  auto recorder = start_recorder({"--resume"});
  const auto server = start_server();
  auto client = start_client();
  ASSERT_TRUE(wait_for_rows()) << server->output();
  client->kill();
  recorder->kill();
  client = start_client();
  recorder = start_recorder({"--resume"});
  expect_success({server.get(), client.get(), recorder.get()});
  EXPECT_FALSE(read_manifest(recording()).at("complete").get<bool>()) << "the first segment";
  const auto manifest = read_manifest(recording() / "segment-2");
  EXPECT_TRUE(manifest.at("complete").get<bool>()) << manifest;
  EXPECT_EQ(manifest.at("segment").at("number"), 2);
  EXPECT_GT(manifest.at("segment").at("first_step").get<int>(), 0);
  expect_undisturbed(recording(), file_);
}

TEST_F(RestartTest, AKilledServerIsReplacedAndProgramsWithFollowFlyTheNewRun) {
  const auto recorder = start_recorder({"--follow"});
  auto server = start_server();
  const auto client = start_client({"--follow"});
  ASSERT_TRUE(wait_for_rows()) << server->output();
  server->kill();
  server = start_server();
  expect_success({server.get(), client.get(), recorder.get()});
  EXPECT_TRUE(holds(client->output(), "was replaced by run")) << client->output();
  EXPECT_TRUE(holds(recorder->output(), "was replaced by run")) << recorder->output();
  const auto first = read_manifest(recording());
  EXPECT_FALSE(first.at("complete").get<bool>());
  fs::path second;
  for (const auto& entry : fs::directory_iterator(recording()))
    if (entry.is_directory()) second = entry.path();
  ASSERT_EQ(second.filename().string().rfind("run-", 0), 0u) << second;
  EXPECT_NE(read_manifest(second).at("run_id"), first.at("run_id"));
  expect_undisturbed(second, file_);
}

/// A killed process cannot remove its shared memory. The next process must still start.
TEST_F(RestartTest, StaleSharedMemoryStopsNoStart) {
  file_ = scenario("short");
  std::vector<fs::path> left;
  for (int i = 0; i < 3; ++i) {
    const auto server = start_server();
    ASSERT_TRUE(wait_for_text(*server, "run ")) << server->output();
    const auto own = find_shared_memory(server->id());
    EXPECT_FALSE(own.empty());
    left.insert(left.end(), own.begin(), own.end());
    server->send(SIGKILL);  // without the clean-up of Process::kill
    EXPECT_EQ(server->wait(), 137);
  }
  for (const auto& file : left) EXPECT_TRUE(fs::exists(file)) << file;
  const auto recorder = start_recorder(), server = start_server(), client = start_client();
  expect_success({server.get(), client.get(), recorder.get()});
  for (const auto& file : left) fs::remove(file);
}

}  // namespace
}  // namespace sls::test
