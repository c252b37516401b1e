// Checks the files of a recorder that is killed and started again.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/config/config_error.hpp"
#include "recorder/verification.hpp"
#include "tests/recorder/csv_table.hpp"
#include "tests/recorder/flights.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/text.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;
using namespace test;
using sls::test::read_bytes;
using sls::test::write_bytes;
using Json = nlohmann::json;

class SegmentsTest : public testing::Test {
 protected:
  SegmentsTest() {
    fs::create_directory(whole_);
    record_flight(whole_);
    fs::create_directory(out_);
  }

  Segment resume() { return make_next_segment(open_recording(out_)); }

  /// Records `segment` to the end of the run; the histories begin at step `oldest`.
  bool record_to_the_end(const Segment& segment, std::uint64_t oldest) {
    Recording recording(segment, make_parameters());
    EXPECT_EQ(recording.last_complete_step(), static_cast<std::int64_t>(segment.first_step) - 1);
    add_steps(recording, oldest, kLastStep);
    return finish_flight(recording);
  }

  Json read_manifest(const fs::path& folder) {
    return Json::parse(read_bytes(folder / "manifest.json"));
  }
  std::vector<std::string> list_status_samples(const fs::path& folder) {
    const CsvTable table = parse_csv(read_bytes(folder / "status.csv"));
    std::vector<std::string> indices;
    for (std::size_t row = 0; row < table.rows.size(); ++row)
      indices.push_back(table.text(row, "sample_index"));
    return indices;
  }
  std::string find_difference() {
    const auto difference = find_first_difference(open_recording(whole_), open_recording(out_));
    return difference ? difference->text : "equal";
  }
  void expect_equal_to_the_undisturbed(const fs::path& last_segment) {
    EXPECT_EQ(find_difference(), "equal");
    const Json manifest = read_manifest(last_segment);
    EXPECT_EQ(manifest.at("complete"), true);
    EXPECT_EQ(manifest.at("missing"), Json::array());
    EXPECT_EQ(manifest.at("certificate"), read_manifest(whole_).at("certificate"));
    const Inspection inspection = inspect(open_recording(out_));
    EXPECT_TRUE(inspection.problems.empty()) << inspection.problems.front();
  }

  const sls::test::TemporaryFolder folder_;
  const fs::path whole_ = folder_ / "whole", out_ = folder_ / "out";
};

TEST_F(SegmentsTest, AResumedRecordingEqualsTheUndisturbedOne) {
  record_until_killed(make_segment(out_), 0, 150);
  const Segment segment = resume();
  EXPECT_EQ(segment.number, 2);
  EXPECT_EQ(segment.folder, out_ / "segment-2");
  EXPECT_EQ(segment.first_step, 151u);
  EXPECT_TRUE(record_to_the_end(segment, 20));
  expect_equal_to_the_undisturbed(segment.folder);
  EXPECT_EQ(read_manifest(segment.folder).at("segment"),
            Json({{"number", 2}, {"first_step", 151}}));
  EXPECT_EQ(read_manifest(out_).at("complete"), false) << "the last segment covers all";
  const auto table = parse_csv(read_bytes(segment.folder / "state.csv"));
  EXPECT_EQ(table.text(0, "step"), "151");
}

TEST_F(SegmentsTest, TheLastSegmentsFlightTextIsThatOfTheWholeFlight) {
  record_until_killed(make_segment(out_), 0, 150);
  const Segment segment = resume();
  record_to_the_end(segment, 0);
  const auto cut = [](const std::string& text) {  // without the events
    return text.substr(0, text.find("Events"));
  };
  EXPECT_EQ(cut(read_bytes(segment.folder / "flight.txt")), cut(read_bytes(whole_ / "flight.txt")));
}

TEST_F(SegmentsTest, LapsOfAStageJoinedLateCountFromItsStartAfterARestartToo) {
  record_until_killed(make_segment(out_), 150, 220);  // the stage began at step 100
  EXPECT_EQ(read_manifest(out_).at("stage_starts"),
            Json::array({{{"vehicle_id", 0}, {"stage", 1}, {"step", 100}}}));
  const Segment segment = resume();
  record_to_the_end(segment, 210);
  EXPECT_EQ(read_manifest(segment.folder).at("stage_starts"),
            read_manifest(out_).at("stage_starts"));
  const auto second_lap = [](const fs::path& folder) {
    const std::string text = read_bytes(folder / "flight.txt");
    return text.substr(text.find("lap 2 "), text.find("\n\nCommands") - text.find("lap 2 "));
  };
  EXPECT_EQ(second_lap(segment.folder), second_lap(whole_));
}

TEST_F(SegmentsTest, ItMayBeKilledOftenAndAnywhere) {
  record_until_killed(make_segment(out_), 0, 100);
  record_until_killed(resume(), 50, 160);
  {  // killed before it wrote its manifest
    Recording recording(resume(), make_parameters());
    fs::remove(out_ / "segment-3/manifest.json");
  }
  record_until_killed(resume(), 100, 240);
  const Segment segment = resume();
  EXPECT_EQ(segment.number, 4);
  EXPECT_TRUE(record_to_the_end(segment, 200));
  expect_equal_to_the_undisturbed(out_ / "segment-4");
}

TEST_F(SegmentsTest, RowsCutAnywhereAreRecordedAgain) {
  record_until_killed(make_segment(out_), 0, 150);
  std::map<std::string, std::string> files;
  for (const char* name : {"state.csv", "command.csv", "reference.csv"})
    files[name] = read_bytes(out_ / name);
  for (const auto& [name, bytes] : files)
    for (const std::size_t surplus : {1u, 30u, 300u, 3000u}) {
      SCOPED_TRACE(name + " less " + std::to_string(surplus));
      for (const auto& [file, content] : files) write_bytes(out_ / file, content);
      write_bytes(out_ / name, bytes.substr(0, bytes.size() - surplus));
      fs::remove_all(out_ / "segment-2");
      const Segment segment = resume();
      EXPECT_LT(segment.first_step, 151u);
      EXPECT_TRUE(record_to_the_end(segment, 0));
      expect_equal_to_the_undisturbed(segment.folder);
    }
}

TEST_F(SegmentsTest, AnInterruptedRecordingCanBeResumedToo) {
  {
    Recording recording(out_, make_parameters());
    add_steps(recording, 0, 150);
    recording.finish("interrupted by SIGTERM", 0);
  }
  const Segment segment = resume();
  EXPECT_TRUE(record_to_the_end(segment, 0));
  expect_equal_to_the_undisturbed(segment.folder);
}

// A late reader of sls/status gets the samples of the past again.
TEST_F(SegmentsTest, EachStatusSampleHasOneRowAndOneEvent) {
  const Parameters parameters = make_parameters();
  const std::vector<SimStatus> statuses = {
      make_status(RunPhase::PHASE_WAITING, 0, "missing: controller"),
      make_status(RunPhase::PHASE_RUNNING, 0), make_status(RunPhase::PHASE_RUNNING, 150),
      make_status(RunPhase::PHASE_FINISHED, kLastStep, "mission finished")};
  {
    Recording recording(out_, parameters);
    for (std::size_t i = 0; i < 3; ++i) recording.add(statuses[i]);
    add_steps(recording, 0, 150);
    recording.finish("interrupted by SIGTERM", 0);
  }
  const Segment segment = resume();
  Recording recording(segment, parameters);
  add_steps(recording, 0, kLastStep);
  for (const SimStatus& status : statuses) recording.add(status);
  EXPECT_TRUE(recording.finish("", 0));
  EXPECT_EQ(list_status_samples(out_), (std::vector<std::string>{"0", "1", "2"}));
  EXPECT_EQ(list_status_samples(segment.folder), (std::vector<std::string>{"3"}));
  const std::string text = read_bytes(segment.folder / "flight.txt");
  EXPECT_EQ(text.find("missing: controller"), text.npos) << text;
  EXPECT_NE(text.find("finished: mission finished"), text.npos) << text;
}

TEST_F(SegmentsTest, UnansweredStepsAreWholeWithoutAReference) {
  const auto add = [](Recording& recording, std::uint64_t from, std::uint64_t to) {
    BatchFeeder feeder(recording, from);
    for (std::uint64_t step = from; step <= to; ++step)
      feeder.add({step < 40 || step >= 60 ? make_entry(step)
                                          : make_unanswered_entry(step, AnswerKind::ANSWER_HELD)},
                 step == kLastStep);
  };
  fs::remove_all(whole_);
  fs::create_directory(whole_);
  {
    Recording recording(whole_, make_parameters());
    add(recording, 0, kLastStep);
    EXPECT_TRUE(finish_flight(recording));
  }
  {
    Recording recording(out_, make_parameters());
    add(recording, 0, 116);  // steps before 52 can get no late answer any more
    while (fs::file_size(out_ / "command.csv") < 200) recording.flush_if_due();
  }
  const Segment segment = resume();
  EXPECT_EQ(segment.first_step, 52u);
  {
    Recording recording(segment, make_parameters());
    add(recording, 30, kLastStep);
    EXPECT_TRUE(finish_flight(recording));
  }
  expect_equal_to_the_undisturbed(segment.folder);
  EXPECT_EQ(read_manifest(whole_).at("unanswered_steps"), 20);
  EXPECT_EQ(read_manifest(segment.folder).at("unanswered_steps"), 8);
}

TEST_F(SegmentsTest, SignalsAreJoinedToo) {
  fs::remove_all(whole_);
  fs::create_directory(whole_);
  record_flight(whole_, {}, make_signal_parameters());
  {
    Recording recording(out_, make_signal_parameters());
    add_steps(recording, 0, 150);
    recording.finish("interrupted by SIGTERM", 0);
  }
  const Segment segment = resume();
  {
    Recording recording(segment, make_signal_parameters());
    add_steps(recording, 100, kLastStep);
    EXPECT_TRUE(finish_flight(recording));
  }
  expect_equal_to_the_undisturbed(segment.folder);
}

TEST_F(SegmentsTest, ASegmentOfAnotherScenarioIsRefused) {
  record_until_killed(make_segment(out_), 0, 150);
  Parameters parameters = make_parameters();
  parameters.scenario_sha256(std::string(64, 'f'));
  EXPECT_THROW(Recording(resume(), parameters), config::ConfigError);
}

TEST_F(SegmentsTest, SegmentsOfTwoRunsAreNotRead) {
  record_until_killed(make_segment(out_), 0, 150);
  record_to_the_end(resume(), 0);
  const fs::path manifest = out_ / "segment-2/manifest.json";
  write_bytes(manifest, sls::test::replace_once(read_bytes(manifest), "0123456789abcdef",
                                                "ffffffffffffffff"));
  EXPECT_THROW(open_recording(out_), config::ConfigError);
}

}  // namespace
}  // namespace sls::record
