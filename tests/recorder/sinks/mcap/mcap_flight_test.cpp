// Reads sls.mcap of real flights with the libraries of MCAP and Foxglove: judge.mjs compares every
// message with the CSV files. Without node and its packages these tests are skipped.
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFormat = "record: { format: [csv, mcap] }\n";

std::uint64_t count_csv_bytes(const fs::path& recording) {
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::directory_iterator(recording))
    if (entry.path().extension() == ".csv") bytes += entry.file_size();
  return bytes;
}

class McapFlightTest : public testing::Test {
 protected:
  /// A shipped scenario with `changes` and `further` keys, recorded as MCAP too.
  std::string make_file(const std::string& base, const std::string& further = "",
                        const std::vector<std::pair<std::string, std::string>>& changes = {}) {
    const std::string file = make_scenario(folder_, changes, base);
    write_bytes(file, read_file(file) + further + kFormat);
    return file;
  }

  /// Flies the scenario `file` in one process. @returns the recording.
  fs::path fly(const std::string& file, const std::string& name = "in-process") {
    const fs::path out = folder_ / name;
    Process flight({program("closed_loop"), "--scenario", file, "--out", out});
    EXPECT_EQ(flight.wait(), 0) << flight.output();
    return out;
  }

  /// Converts `recording` into a file and returns it.
  fs::path convert(const fs::path& recording) {
    const fs::path out = folder_ / "converted.mcap";
    Process conversion({program("sls_convert"), recording, "--out", out, "--force"});
    EXPECT_EQ(conversion.wait(), 0) << conversion.output();
    return out;
  }

  /// Expects that judge.mjs finds no difference. @returns its output.
  nlohmann::json judge(const fs::path& recording, const std::vector<std::string>& options = {}) {
    std::vector<std::string> command = {
        "node", SLS_SOURCE_DIR "/tests/recorder/sinks/mcap/judge.mjs", recording};
    command.insert(command.end(), options.begin(), options.end());
    Process process(command);
    EXPECT_EQ(process.wait(), 0) << process.output();
    return nlohmann::json::parse(process.output(), nullptr, false);
  }

  const TemporaryFolder folder_;
};

TEST_F(McapFlightTest, EveryMessageOfAFigureEightIsItsCsvRowAndTheFileHasAThirdOfTheirSizeAtMost) {
  for (const char* name : {"figure_eight", "multirotor_figure_eight"}) {
    const fs::path recording = fly(make_file(name, "", {{"for_s: 32", "for_s: 16"}}), name);
    const auto read = judge(recording);
    EXPECT_EQ(read.at("messages").at("/sls/vehicle_0/record"), 4001);
    EXPECT_GT(read.at("chunks"), 3);
    EXPECT_LE(3 * fs::file_size(recording / "sls.mcap"), count_csv_bytes(recording)) << name;
    EXPECT_EQ(read_file(convert(recording)) == read_file(recording / "sls.mcap"), true);
  }
}

TEST_F(McapFlightTest, HoldsForAFleetWithFaultySensorsAndLinks) {
  const fs::path recording = fly(make_file("short", R"(vehicles: 3
faults:
  - noise: { on: state, seed: 3, position_m: [0.001, 0.001, 0.001] }
  - drop: { on: command, probability: 0.1, seed: 7 }
)"));
  ASSERT_TRUE(fs::exists(recording / "measured.csv"));
  const auto messages = judge(recording).at("messages");
  for (const char* topic : {"/sls/vehicle_0/record", "/sls/vehicle_2/record"})
    EXPECT_EQ(messages.at(topic), 501);
  EXPECT_EQ(messages.at("/sls/vehicle_2/quadrotor/pose"), 201) << "100 a simulated second";
  EXPECT_EQ(read_file(convert(recording)) == read_file(recording / "sls.mcap"), true);
}

TEST_F(McapFlightTest, OneLoadIsDrawnOnceWithItsAttitudeAndCablesThatAreTautSlackOrCut) {
  const fs::path cut = fly(
      make_file("cable_cut", "", {{"release_s: 8", "release_s: 1"}, {"for_s: 22", "for_s: 1"}}));
  const auto cables = judge(cut).at("cables");
  EXPECT_GT(cables.at("taut"), 160);  // 20 a second and vehicle
  EXPECT_GT(cables.at("cut"), 30);
  const fs::path slack = fly(make_file("slack_drop", "", {{"for_s: 10", "for_s: 1"}}), "slack");
  EXPECT_GT(judge(slack).at("cables").at("slack"), 4);
}

TEST_F(McapFlightTest, AFlightHasTheSameBytesOverSharedMemoryOverUdpAndInOneProcess) {
  const std::string file = make_file("short", "vehicles: 2\n");
  const fs::path recording = fly(file);
  judge(recording);
  const std::string bytes = read_file(recording / "sls.mcap");
  for (const std::string& profile : {std::string(), qos("udp")}) {
    Flight flight(file, {profile, {}, {}});
    flight.expect_success();
    EXPECT_EQ(read_file(flight.recording() / "sls.mcap") == bytes, true) << profile;
    Process verify({program("sls_verify"), flight.recording()});
    EXPECT_EQ(verify.wait(), 0) << verify.output();
  }
}

TEST_F(McapFlightTest, AfterSigkillTheStreamReaderReadsAllWholeChunksAndConvertRestoresTheRest) {
  const std::string file = make_file("figure_eight", "vehicles: 2\n");
  Flight flight(file);
  ASSERT_TRUE(wait_until([&] {
    return read_file(flight.recording() / "sls.mcap").size() > 500'000;
  })) << flight.outputs();
  flight.recorder->kill();
  for (Process* process : {flight.server.get(), flight.client.get()}) {
    process->send(SIGTERM);
    EXPECT_TRUE(process->wait().has_value());
  }
  const auto cut = judge(flight.recording(), {"--cut"});
  EXPECT_GT(cut.at("messages").at("/sls/vehicle_1/record"), 300);
  const fs::path whole = convert(flight.recording());
  const auto all = judge(flight.recording(), {"--file", whole});
  EXPECT_GE(all.at("messages").at("/sls/vehicle_1/record"),
            cut.at("messages").at("/sls/vehicle_1/record"));
  const std::string bytes = read_file(flight.recording() / "sls.mcap");
  EXPECT_EQ(read_file(whole).compare(0, bytes.size(), bytes), 0) << "the whole chunks are the same";
}

TEST_F(McapFlightTest, ARecorderThatIsKilledAndResumedLeavesAFileInEachSegmentAndConvertJoinsThem) {
  const std::string file = make_file("short");
  Flight flight(file, {{}, {"--mode", "realtime"}, {}});
  ASSERT_TRUE(flight.wait_for_steps(150)) << flight.outputs();
  flight.recorder->kill();
  Process resumed(
      make_command("recorder", flight.domain.number(), {"--out", flight.recording(), "--resume"}));
  flight.server->wait();
  flight.client->wait();
  EXPECT_EQ(resumed.wait(), 0) << resumed.output();
  const fs::path second = flight.recording() / "segment-2";
  judge(second);
  EXPECT_EQ(read_file(convert(second)) == read_file(second / "sls.mcap"), true);
  const auto all =
      judge(flight.recording(), {"--file", convert(flight.recording()), "--joined", second});
  EXPECT_EQ(all.at("messages").at("/sls/vehicle_0/record"), 501);
}

TEST_F(McapFlightTest, TheJudgesReaderNoticesAByteThatHasChanged) {
  const fs::path recording = fly(make_file("short"));
  const fs::path file = recording / "sls.mcap";
  const std::string bytes = read_file(file);
  std::string changed = bytes;
  changed[bytes.size() / 2] ^= 1;
  write_bytes(file, changed);
  Process process({"node", SLS_SOURCE_DIR "/tests/recorder/sinks/mcap/judge.mjs", recording});
  EXPECT_EQ(process.wait(), 1) << process.output();
}

TEST(ConvertTest, PrintsOneErrorLineAndExitsWithItsCode) {
  const TemporaryFolder folder;
  const fs::path recording = folder / "recording";
  {
    Process flight({program("closed_loop"), "--scenario", scenario("short"), "--out", recording});
    ASSERT_EQ(flight.wait(), 0) << flight.output();
  }
  const auto run = [&](const std::vector<std::string>& options, int code, const std::string& text) {
    std::vector<std::string> command = {program("sls_convert")};
    command.insert(command.end(), options.begin(), options.end());
    Process process(command);
    EXPECT_EQ(process.wait(), code) << process.output();
    EXPECT_TRUE(holds(process.output(), text)) << process.output();
  };
  run({folder / "nothing"}, 2, "expected a recording");
  run({recording}, 0, "sls.mcap: ");
  run({recording}, 2, "--force");
  run({recording, "--force"}, 0, " messages\n");
  run({recording, "--out", folder / "no/such.mcap"}, 2, "expected a folder that exists");
  Process verify({program("sls_verify"), recording});
  EXPECT_EQ(verify.wait(), 0) << "a converted file is no part of the recording: "
                              << verify.output();
  write_bytes(recording / "command.csv", read_file(recording / "command.csv") + "x,y\n");
  run({recording, "--force"}, 1, "command.csv");
  EXPECT_FALSE(fs::exists(recording / "sls.mcap.part"));
}

}  // namespace
}  // namespace sls::test
