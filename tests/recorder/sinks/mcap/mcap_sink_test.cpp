// Compares sls.mcap with the converted CSV files, byte for byte. mcap_flight_test checks its
// content.
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <system_error>

#include "common/config/config_error.hpp"
#include "common/text/sha256.hpp"
#include "recorder/sinks/mcap/mcap_file.hpp"
#include "recorder/verification.hpp"
#include "tests/recorder/file_size_limit.hpp"
#include "tests/recorder/flights.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/text.hpp"
#include "tools/convert/conversion.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;
using namespace test;
using sls::test::holds;
using sls::test::read_bytes;
using sls::test::write_bytes;

/// The same run with a scenario text that requests the format.
Parameters ask_for_mcap(Parameters parameters) {
  const std::string text = kScenarioText + std::string("record: { format: [csv, mcap] }\n");
  parameters.scenario_text(text);
  parameters.scenario_sha256(text::calc_sha256(text));
  return parameters;
}

class McapSinkTest : public testing::Test {
 protected:
  McapSinkTest() { fs::create_directory(out_); }

  std::string convert(const fs::path& recording, bool force = true) {
    convert::write_mcap(open_recording(recording), converted_, force);
    return read_bytes(converted_);
  }
  /// For the recording in `out_`.
  void expect_conversion_gives_the_bytes_of_the_sink() {
    const std::string bytes = read_bytes(out_ / "sls.mcap");
    EXPECT_GT(bytes.size(), 20'000u);
    EXPECT_EQ(convert(out_) == bytes, true);
  }
  std::string find_conversion_error(const fs::path& recording, const fs::path& out, bool force) {
    return sls::test::find_error<config::ConfigError>(
        [&] { convert::write_mcap(open_recording(recording), out, force); });
  }

  const sls::test::TemporaryFolder folder_;
  const fs::path out_ = folder_ / "out", other_ = folder_ / "other";
  const fs::path converted_ = folder_ / "converted.mcap";
};

TEST_F(McapSinkTest, ScenariosThatDoNotAskForItHaveNoSuchFile) {
  record_flight(out_);
  EXPECT_FALSE(fs::exists(out_ / "sls.mcap"));
  EXPECT_FALSE(holds(read_bytes(out_ / "manifest.json"), "zstd"));
}

TEST_F(McapSinkTest, EqualFlightsGiveEqualFilesForAnyRunIdAndComputeTimes) {
  record_flight(out_, {}, ask_for_mcap(make_parameters()));
  fs::create_directory(other_);
  Parameters parameters = ask_for_mcap(make_parameters());
  parameters.version("sls 9.9");
  parameters.mode(SyncMode::MODE_REALTIME);
  record_flight(
      other_, [](RecordEntry& entry) { entry.answer().compute_time_ns(7); }, parameters);
  EXPECT_NE(read_bytes(out_ / "command.csv"), read_bytes(other_ / "command.csv"));
  EXPECT_EQ(read_bytes(out_ / "sls.mcap"), read_bytes(other_ / "sls.mcap"));
}

TEST_F(McapSinkTest, ConvertsAttitudeSignalsMeasurementsAndNanByteForByte) {
  record_flight(
      out_,
      [](RecordEntry& entry) {
        constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
        entry.truth().signals().resize(entry.step() % 5);
        if (entry.step() % 7 == 3) entry.truth().v_WL_m_s({-kNone, kNone, -0.0});
        if (entry.step() % 11 == 5)
          entry.truth().alpha_rad(std::numeric_limits<double>::infinity());
        if (entry.step() < 50 || entry.step() % 2 == 0) return;
        entry.measured({entry.truth()});
        entry.measured()[0].p_WQ_m()[0] += 1;
      },
      ask_for_mcap(make_signal_parameters()));
  ASSERT_TRUE(fs::exists(out_ / "measured.csv"));
  expect_conversion_gives_the_bytes_of_the_sink();
}

TEST_F(McapSinkTest, SoItIsOfAFleetWithUnansweredLateAndMissingSteps) {
  Parameters parameters = ask_for_mcap(make_parameters());
  set_vehicles(parameters, {1, 4, 7});
  {
    Recording recording(out_, parameters);
    BatchFeeder feeder(recording);
    for (std::uint64_t step = 0; step <= kLastStep; ++step)
      for (const std::uint32_t id : {1u, 4u, 7u}) {
        if (step == 33 && id == 4) continue;  // lost
        RecordEntry entry = make_entry(step, id);
        if (id == 7 && step >= 10 && step < 20)
          entry = make_unanswered_entry(
              step, step < 15 ? AnswerKind::ANSWER_HELD : AnswerKind::ANSWER_FAIL_SAFE);
        entry.vehicle_id(id);
        if (step == kLastStep && id == 7) entry = make_bare_entry(step);
        entry.vehicle_id(id);
        feeder.add({entry});
        if (step == 22 && id == 1) feeder.add({make_late_entry(12, 7)});
      }
    recording.add(make_status(RunPhase::PHASE_FAILED, kLastStep, "made to"));
    EXPECT_FALSE(recording.finish("", 0));
  }
  expect_conversion_gives_the_bytes_of_the_sink();
}

TEST_F(McapSinkTest, TheManifestListsTheFileAndItsCompressorAndVerifyChecksIt) {
  record_flight(out_, {}, ask_for_mcap(make_parameters()));
  const auto manifest = nlohmann::json::parse(read_bytes(out_ / "manifest.json"));
  EXPECT_EQ(manifest.at("files").at("sls.mcap").at("sha256"),
            text::calc_file_sha256(out_ / "sls.mcap"));
  EXPECT_FALSE(manifest.at("files").at("sls.mcap").contains("rows"));
  EXPECT_EQ(manifest.at("versions").at("zstd"), describe_compression().version);
  EXPECT_TRUE(inspect(open_recording(out_)).problems.empty());
  std::string bytes = read_bytes(out_ / "sls.mcap");
  bytes[bytes.size() / 2] ^= 1;
  write_bytes(out_ / "sls.mcap", bytes);
  const Inspection inspection = inspect(open_recording(out_));
  ASSERT_EQ(inspection.problems.size(), 1u);
  EXPECT_TRUE(holds(inspection.problems.front(), "sls.mcap: SHA-256")) << inspection.problems[0];
}

TEST_F(McapSinkTest, ForceReplacesTheFileAndAPartOfAConversion) {
  record_flight(out_, {}, ask_for_mcap(make_parameters()));
  write_bytes(out_ / "sls.mcap.part", "killed amid it");
  prepare_recording_folder(out_, true);
  EXPECT_TRUE(fs::is_empty(out_));
}

// --- segments and recordings without their end ---------------------------------------------------

TEST_F(McapSinkTest, EachSegmentHasItsRowsAndAllJoinedGiveTheUndisturbedFlight) {
  fs::create_directory(other_);
  record_flight(other_, {}, ask_for_mcap(make_parameters()));
  const Parameters parameters = ask_for_mcap(make_parameters());
  {
    Recording recording(out_, parameters);  // destroyed without an end, as if killed
    add_steps(recording, 0, 150);
    while (fs::file_size(out_ / "command.csv") < 200) recording.flush_if_due();
  }
  EXPECT_LT(fs::file_size(out_ / "sls.mcap"), fs::file_size(other_ / "sls.mcap"));
  const Segment segment = make_next_segment(open_recording(out_));
  {
    Recording recording(segment, parameters);
    add_steps(recording, 20, kLastStep);
    EXPECT_TRUE(finish_flight(recording));
  }
  const std::string whole = read_bytes(other_ / "sls.mcap");
  EXPECT_EQ(convert(out_) == whole, true);
  const std::string second = read_bytes(segment.folder / "sls.mcap");
  EXPECT_LT(second.size(), whole.size());
  EXPECT_EQ(convert(segment.folder) == second, true);
}

TEST_F(McapSinkTest, AFileWhoseDiskIsFullKeepsItsWholeChunksAndTheErrorNamesIt) {
  const fs::path path = folder_ / "full.mcap";
  std::string noise(100'000, '\0');
  std::uint32_t state = 1;
  std::string error;
  {
    McapFile file(path);
    const auto channel =
        file.add_channel(file.add_schema("A", "omgidl", "struct A {};"), "a", "cdr");
    const FileSizeLimit limit(2'500'000);
    try {
      for (std::uint32_t i = 0; i < 100; ++i) {
        for (char& byte : noise)
          byte = static_cast<char>((state = state * 1664525 + 1013904223) >> 24);
        file.add_message(channel, i, i, noise);
        if (file.pending_bytes() > 0) file.flush();
      }
    } catch (const std::system_error& caught) {
      error = caught.what();
    }
  }
  EXPECT_TRUE(holds(error, path.string() + ": cannot write")) << error;
  EXPECT_TRUE(holds(error, "File too large")) << error;
  // Two chunks of eleven messages of noise, which do not compress.
  EXPECT_GT(fs::file_size(path), 2'200'000u);
  EXPECT_LT(fs::file_size(path), 2'300'000u);
}

TEST_F(McapSinkTest, AFileThatCannotBeMadeIsNamed) {
  write_bytes(folder_ / "there.mcap", "");
  const std::string error =
      sls::test::find_error<std::system_error>([&] { McapFile(folder_ / "there.mcap"); });
  EXPECT_TRUE(holds(error, folder_ / "there.mcap: cannot create")) << error;
}

// --- conversion ----------------------------------------------------------------------------------

TEST_F(McapSinkTest, ConvertingReplacesFilesOnlyWithForceAndNeverListedOnes) {
  record_flight(out_, {}, ask_for_mcap(make_parameters()));
  EXPECT_EQ(find_conversion_error(out_, converted_, false), "no error");
  EXPECT_TRUE(holds(find_conversion_error(out_, converted_, false), "--force"));
  EXPECT_EQ(find_conversion_error(out_, converted_, true), "no error");
  const fs::path listed = convert::make_default_output(open_recording(out_));
  EXPECT_EQ(listed, out_ / "sls.mcap");
  EXPECT_TRUE(holds(find_conversion_error(out_, listed, true), "the manifest beside it lists"));
  EXPECT_TRUE(holds(find_conversion_error(out_, out_ / "state.csv", true), "ends in .mcap"));
  EXPECT_TRUE(holds(find_conversion_error(out_, other_ / "no/folder.mcap", true), "no/folder"));
}

TEST_F(McapSinkTest, AConversionThatFailsLeavesNoFileAndKeepsTheOneThatIsThere) {
  record_flight(out_, {}, ask_for_mcap(make_parameters()));
  const std::string earlier = convert(out_);
  const std::string states = read_bytes(out_ / "state.csv");
  write_bytes(out_ / "state.csv", states.substr(0, states.size() / 2) + "nonsense\n" +
                                      states.substr(states.size() / 2));
  EXPECT_THROW(convert(out_), DamagedError);
  EXPECT_EQ(read_bytes(converted_) == earlier, true);
  EXPECT_FALSE(fs::exists(converted_.string() + ".part"));
}

TEST_F(McapSinkTest, ARecordingOfContract1ConvertsToo) {
  record_flight(out_);
  const std::string expected = convert(out_);
  auto manifest = nlohmann::json::parse(read_bytes(out_ / "manifest.json"));
  for (const char* key : {"segment", "stage_starts", "contract_sha256"}) manifest.erase(key);
  write_bytes(out_ / "manifest.json", manifest.dump());
  const std::string bytes = convert(out_);
  EXPECT_GT(bytes.size(), 20'000u);
  EXPECT_NE(bytes, expected) << "the attached manifest has no contract";
}

TEST_F(McapSinkTest, StepsWithoutAStateAreThereInTheOrderOfTheirVehicle) {
  record_flight(out_);
  std::string states = read_bytes(out_ / "state.csv");
  const auto begin = states.find("\n0,100,") + 1, end = states.find("\n0,101,") + 1;
  write_bytes(out_ / "state.csv", states.erase(begin, end - begin));
  const OpenedRecording flight = open_recording(out_);
  StepReader reader(flight);
  for (std::uint64_t step = 0; step <= kLastStep; ++step) {
    const auto rows = reader.next_as_written();
    ASSERT_TRUE(rows);
    EXPECT_EQ(rows->step, step);
    EXPECT_EQ(rows->has_state, step != 100);
    EXPECT_TRUE(rows->has_command);
  }
  EXPECT_FALSE(reader.next_as_written());
}

}  // namespace
}  // namespace sls::record
