#include "recorder/core/recording_core.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/common/sync/samples.hpp"
#include "tests/recorder/synthetic_run.hpp"

namespace sls::record {
namespace {

using namespace test;
using sync::at;

/// A recording that begins at time 0 and flushes its files every 0.2 s. Its outputs are words.
class RecordingCoreTest : public testing::Test, public RecordingOutputs {
 protected:
  using Phase = RecordingCore::Phase;
  using Entries = std::vector<RecordEntry>;
  static constexpr auto kRunning = RunPhase::PHASE_RUNNING, kFinished = RunPhase::PHASE_FINISHED,
                        kFailed = RunPhase::PHASE_FAILED, kReset = RunPhase::PHASE_RESET;

  RecordingCoreTest() { begin(); }

  void begin(std::uint64_t first_step = 0, const Parameters& parameters = make_parameters()) {
    core_.emplace(parameters, first_step, 0.2, at(0), *this);
    batch_ = 0;
    said_.clear();
  }
  void receive(const Entries& entries, bool is_last = false, std::int64_t ms = 0) {
    core_->on_batch(make_batch(batch_++, entries, is_last), at(ms));
  }
  void fly(std::uint64_t from, std::uint64_t to) {
    for (; from <= to; ++from) receive({make_entry(from)});
  }
  void tell(RunPhase phase, std::uint64_t step, const std::string& reason = "") {
    core_->on_status(make_status(phase, step, reason));
  }
  /// A finished run of the steps up to 9.
  void fly_to_the_end() {
    tell(kRunning, 0);
    fly(0, 8);
    receive({make_entry(9)}, true);
    tell(kFinished, 9, "mission finished");
  }
  Claims end(const std::string& reason = "", std::uint64_t refused = 0) {
    return core_->on_end({reason, "lost"}, refused);
  }
  /// The words since the last call.
  std::string said() { return std::exchange(said_, {}); }
  std::string said_at(std::int64_t ms) {
    core_->on_time(at(ms));
    return said();
  }

  bool add(const StepRows& rows) override {
    said_ += fmt::format("row{} ", rows.step);
    return is_full_;
  }
  void add(const SimStatus& status, bool is_repeated) override {
    said_ += fmt::format("{}{} ", is_repeated ? "again" : "status", status.sample_index());
  }
  void add_event(const std::string& text) override { said_ += "<" + text + "> "; }
  bool has_new_stage() const override { return has_new_stage_; }
  void write_manifest(const Claims& claims) override { said_ += claims.outcome + " "; }
  void flush() override { said_ += "flush "; }
  void log(const sync::Line& line) override {
    said_ += (line.is_warning ? "W " : "I ") + line.text;
  }

  std::optional<RecordingCore> core_;
  std::uint64_t batch_ = 0;
  bool is_full_ = false, has_new_stage_ = false;
  std::string said_;
};

std::string to_text(const MissingSamples& missing) {
  std::string text;
  for (const MissingSteps& gap : missing.listed)
    text += fmt::format("{} {}-{} ", gap.topic.substr(4), gap.from, gap.to);
  return text;
}

TEST_F(RecordingCoreTest, AWholeRunIsComplete) {
  EXPECT_EQ(core_->last_complete_step(), -1);
  fly_to_the_end();
  EXPECT_EQ(said(), "status0 row0 row1 row2 row3 row4 row5 row6 row7 row8 row9 status1 ");
  EXPECT_EQ(core_->phase(), Phase::kWhole);
  EXPECT_EQ(core_->last_complete_step(), 9);
  const Claims claims = end("too late to interrupt it");
  EXPECT_EQ(said(), "");
  EXPECT_TRUE(claims.complete);
  EXPECT_EQ(claims.outcome, "finished");
  EXPECT_EQ(claims.reason, "mission finished");
  EXPECT_EQ(claims.timing, "exact");
  EXPECT_EQ(claims.last_step, 9u);
}

TEST_F(RecordingCoreTest, TheEndTakesBothTheStatusAndTheLastBatch) {
  tell(kFinished, 1);
  fly(0, 1);
  EXPECT_EQ(core_->phase(), Phase::kReceiving);
  receive({}, true);
  EXPECT_EQ(core_->phase(), Phase::kWhole);
}

TEST_F(RecordingCoreTest, EveryVehicleIsWaitedFor) {
  Parameters parameters = make_parameters();
  set_vehicles(parameters, {0, 7});
  begin(0, parameters);
  receive({make_entry(0, 0), make_bare_entry(1)});
  EXPECT_EQ(core_->last_complete_step(), -1);
  receive({make_entry(0, 7)}, true);
  EXPECT_EQ(core_->last_complete_step(), 0);
  tell(kFinished, 1);
  const Claims claims = end();
  EXPECT_EQ(to_text(claims.missing),
            "state 1-1 command 1-1 reference 1-1 command 1-1 reference 1-1 ");
  EXPECT_EQ(claims.missing.listed[0].vehicle_id, 7u);
  EXPECT_EQ(claims.missing.listed[3].vehicle_id, 0u) << "its answer";
}

TEST_F(RecordingCoreTest, SamplesOfOtherRunsAreIgnored) {
  RecordBatch batch = make_batch(0, {make_entry(0)}, true);
  batch.run_id(kRunId + 1);
  core_->on_batch(batch, at(0));
  SimStatus status = make_status(kFinished, 0);
  status.run_id(kRunId + 1);
  core_->on_status(status);
  EXPECT_EQ(said(), "");
  EXPECT_EQ(core_->phase(), Phase::kReceiving);
}

// --- flushing ------------------------------------------------------------------------------------

TEST_F(RecordingCoreTest, FilesAreFlushedEvery200MsAndWhenTheyAreFull) {
  EXPECT_EQ(said_at(199), "");
  EXPECT_EQ(said_at(200), "flush ");
  is_full_ = true;
  receive({make_entry(0)}, false, 350);
  EXPECT_EQ(said(), "row0 flush ");
  EXPECT_EQ(said_at(549), "");
  EXPECT_EQ(said_at(550), "flush ");
}

TEST_F(RecordingCoreTest, AManifestWithANewStageComesBeforeItsRows) {
  has_new_stage_ = true;
  EXPECT_EQ(said_at(200), "recording flush ");
}

// --- missing samples -----------------------------------------------------------------------------

TEST_F(RecordingCoreTest, MissingIsWhatTheRunHadAndTheRecordingHasNot) {
  const auto held = make_unanswered_entry(2, AnswerKind::ANSWER_HELD);
  RecordEntry refused = make_entry(2);
  refused.kind(AnswerKind::ANSWER_REFUSED);
  const RecordEntry e0 = make_entry(0), e1 = make_entry(1), e2 = make_entry(2), e6 = make_entry(6);
  const RecordEntry bare1 = make_bare_entry(1), bare2 = make_bare_entry(2);
  struct Case {
    const char* what;
    Entries entries;
    RunPhase phase;
    std::uint64_t step;
    const char* missing;
  };
  for (const Case& given : std::vector<Case>{
           {"nothing", {e0, e1, e2}, kFinished, 2, ""},
           {"a stretch", {e0, e1, e6}, kFinished, 6, "state 2-5 command 2-5 reference 2-5 "},
           {"all before a late join", {e2}, kFinished, 2, "state 0-1 command 0-1 reference 0-1 "},
           {"the end", {e0, e1}, kFinished, 4, "state 2-4 command 2-4 reference 2-4 "},
           {"an answer", {e0, bare1, e2}, kFinished, 2, "command 1-1 reference 1-1 "},
           {"two answers",
            {e0, bare1, bare2, make_entry(3)},
            kFinished,
            3,
            "command 1-2 reference 1-2 "},
           {"the last one", {e0, bare1}, kFinished, 1, "command 1-1 reference 1-1 "},
           {"a held step has no reference", {e0, e1, held}, kFinished, 2, ""},
           {"a failed run's last answer", {e0, bare1}, kFailed, 1, ""},
           {"a reset run's last answer", {e0, bare1}, kReset, 1, ""},
           {"a failed run's last step", {e0, e1}, kFailed, 2, ""},
           {"a refused answer is recorded", {e0, e1, refused}, kFailed, 2, ""},
           {"more of a failed run", {e0}, kFailed, 2, "state 1-1 command 1-1 reference 1-1 "},
           {"a run that never began", {}, kFailed, 0, ""},
           {"a run that goes on", {e0}, kRunning, 7, ""},
       }) {
    begin();
    receive(given.entries, given.phase != kRunning);
    tell(given.phase, given.step);
    const Claims claims = end(given.phase == kRunning ? "the server is gone" : "");
    EXPECT_EQ(to_text(claims.missing), given.missing) << given.what;
    EXPECT_EQ(claims.complete, given.phase == kFinished && !given.missing[0]) << given.what;
    EXPECT_EQ(claims.last_step, given.phase == kRunning ? 0 : given.step) << given.what;
  }
}

TEST_F(RecordingCoreTest, OfManyGapsTheFirstAreListedAndTheOthersCounted) {
  for (std::uint64_t i = 0; i < 400; ++i) receive({make_entry(2 * i + 1)});
  receive({make_bare_entry(801), make_entry(802)});  // 801 makes gaps of answers longer
  tell(kFinished, 2000);                             // steps 803 to 2000 are missing
  const MissingSamples missing = end().missing;
  EXPECT_EQ(missing.listed.size(), 1000u);
  EXPECT_EQ(missing.further_gaps, 3u * 402 - 1000);
  EXPECT_EQ(missing.further_samples, 3u * (401 + 1198) + 2 - 1000);
  EXPECT_EQ(core_->describe_gaps(), "4799 samples missing, first sls/state step 0 of vehicle 0");
}

TEST_F(RecordingCoreTest, UnansweredStepsAreCounted) {
  receive({make_entry(0), make_unanswered_entry(1, AnswerKind::ANSWER_HELD),
           make_unanswered_entry(2, AnswerKind::ANSWER_FAIL_SAFE), make_late_entry(1)});
  EXPECT_EQ(said(), "row0 row1 ") << "step 2 waits for its late answer";
  EXPECT_EQ(core_->last_complete_step(), 2);
  EXPECT_EQ(end().unanswered_steps, 2u);
  EXPECT_EQ(said(), "row2 ");
}

TEST_F(RecordingCoreTest, SamplesTheQueueRefusedAndDroppedEntriesAreClaimed) {
  core_->on_batch(make_batch(0, {make_entry(0), make_entry(0, 9)}), at(0));
  core_->on_batch(make_batch(0, {make_entry(1)}), at(0));
  core_->on_batch(make_batch(1, {make_entry(1)}, true), at(0));
  tell(kFinished, 1);
  const Claims claims = end("", 3);
  EXPECT_EQ(claims.dropped.repeated, 1u);
  EXPECT_EQ(claims.dropped.out_of_range, 1u);
  EXPECT_EQ(claims.refused_samples, 3u);
  EXPECT_FALSE(claims.complete);
  EXPECT_EQ(core_->describe_gaps(), "3 samples lost because the queue was full");
}

// --- status samples ------------------------------------------------------------------------------

TEST_F(RecordingCoreTest, AStatusSampleCountsOnceAndMissingOnesAreNamed) {
  std::vector<SimStatus> statuses;
  for (int i = 0; i < 6; ++i) statuses.push_back(make_status(kRunning, 0));
  for (const int index : {2, 3, 2, 5, 3}) core_->on_status(statuses[index]);
  EXPECT_EQ(said(), "status2 status3 status5 ");
  EXPECT_EQ(to_text(end("gone").missing), "status 0-1 status 4-4 ");
  EXPECT_EQ(said(),
            "<recorder: gone> "
            "<recorder: 3 samples missing, first sls/status sample 0 of vehicle 0> ");
}

// --- earlier segments ----------------------------------------------------------------------------

TEST_F(RecordingCoreTest, GapsAreThoseOfAllSegments) {
  StepRows rows;
  rows.has_state = rows.has_command = rows.has_reference = true;
  begin(6);
  for (const std::uint64_t step : {0, 1, 3}) {
    rows.step = step;
    core_->on_earlier_step(rows);
  }
  core_->on_earlier_end();
  for (const std::uint64_t index : {0, 2}) core_->on_earlier_status(index);
  EXPECT_EQ(core_->last_complete_step(), 5);
  std::vector<SimStatus> statuses;
  for (int i = 0; i < 3; ++i) statuses.push_back(make_status(kRunning, 0));
  for (const SimStatus& status : statuses) core_->on_status(status);
  fly(4, 6);
  receive({make_entry(8)}, true);
  tell(kFinished, 8);
  EXPECT_EQ(said(), "again0 again1 again2 row6 row8 status3 ") << "the history begins earlier";
  EXPECT_EQ(to_text(end().missing),
            "state 2-2 command 2-2 reference 2-2 state 4-5 command 4-5 reference 4-5 "
            "status 1-1 state 7-7 command 7-7 reference 7-7 ");
}

TEST_F(RecordingCoreTest, RowsThatTheFilesOfAnEarlierSegmentLackAreGaps) {
  struct Case {
    bool has_state, has_command, has_reference;
    const char* missing;
  };
  for (const Case& given :
       {Case{true, true, true, ""}, Case{false, true, true, "state 1-1 "},
        Case{true, false, true, "command 1-1 "}, Case{true, true, false, "reference 1-1 "},
        Case{true, false, false, "command 1-1 reference 1-1 "}}) {
    begin(3);
    StepRows rows;
    for (rows.step = 0; rows.step < 3; ++rows.step) {
      const bool is_whole = rows.step != 1;
      rows.has_state = is_whole || given.has_state;
      rows.has_command = is_whole || given.has_command;
      rows.has_reference = is_whole || given.has_reference;
      core_->on_earlier_step(rows);
    }
    core_->on_earlier_end();
    receive({make_entry(3)}, true);
    tell(kFinished, 3);
    EXPECT_EQ(to_text(end().missing), given.missing);
  }
}

// --- the end -------------------------------------------------------------------------------------

TEST_F(RecordingCoreTest, TheOutcomeIsTheRunsOrThatOfTheInterruption) {
  struct Case {
    RunPhase phase;
    const char *reason, *interruption, *outcome, *claimed, *gaps;
  };
  for (const Case& given : std::vector<Case>{
           {kRunning, "", "", "lost", "", "the run has not ended"},
           {kRunning, "", "the server is gone", "lost", "the server is gone", "the server is gone"},
           {kFailed, "a fault", "", "failed", "a fault", "run failed: see manifest.json"},
           {kFailed, "", "", "failed", "", "run failed"},
           {kFailed, "a fault", "SIGINT", "failed", "SIGINT", "SIGINT; run failed: a fault"},
           {kReset, "by nina", "", "reset", "by nina", "run reset: see manifest.json"},
       }) {
    begin();
    tell(given.phase, 1, given.reason);
    receive({make_entry(0)});
    EXPECT_EQ(core_->has_phase(RunPhase::PHASE_RESET), given.phase == kReset);
    const Claims claims = end(given.interruption);
    EXPECT_EQ(claims.outcome, given.outcome);
    EXPECT_EQ(claims.reason, given.claimed);
    EXPECT_FALSE(claims.complete);
    EXPECT_EQ(core_->describe_gaps(), given.gaps);
  }
}

TEST_F(RecordingCoreTest, UntilTheEndAManifestClaimsThatTheRecorderWasKilled) {
  fly_to_the_end();
  const Claims claims = core_->make_claims();
  EXPECT_EQ(claims.outcome, "recording");
  EXPECT_EQ(claims.reason, "not finished: the recorder is running, or was killed");
  EXPECT_FALSE(claims.complete);
}

// --- a missing batch -----------------------------------------------------------------------------

TEST_F(RecordingCoreTest, AMissingBatchIsReportedAfterASecondAndGivenUpAfterTen) {
  begin();
  core_->on_status(make_status(kFinished, 2));
  core_->on_batch(make_batch(0, {make_entry(0)}), at(0));
  core_->on_batch(make_batch(2, {make_entry(2)}, true), at(100));
  const auto look = [&](std::int64_t from, std::int64_t to) {
    said_.clear();
    for (; from <= to; from += 100) core_->on_time(at(from));
    std::string said = said_;
    while (said.find("flush ") != said.npos) said.erase(said.find("flush "), 6);
    return said;
  };
  EXPECT_EQ(look(200, 1099), "");
  EXPECT_EQ(look(1100, 6099), "W waiting for: batch 1 of sls/record");
  EXPECT_EQ(look(6100, 10'099), "W waiting for: batch 1 of sls/record");
  EXPECT_EQ(core_->phase(), Phase::kReceiving);
  EXPECT_EQ(look(10'100, 10'100), "row2 ");
  EXPECT_EQ(core_->phase(), Phase::kWhole);
  EXPECT_EQ(to_text(end().missing), "state 1-1 command 1-1 reference 1-1 ");
}

TEST_F(RecordingCoreTest, ALostBatchOfLateAnswersIsAGap) {
  for (const std::uint64_t lost : {5, 10}) {
    begin();
    tell(kFinished, 9);
    for (std::uint64_t batch = 0; batch < 10; ++batch) {
      if (batch == lost) ++batch_;
      receive({make_entry(batch)});
    }
    if (lost < 10) receive({}, true, 10'000);
    core_->on_time(at(30'000));
    const Claims claims = end("stopped");
    EXPECT_FALSE(claims.complete);
    EXPECT_EQ(to_text(claims.missing), fmt::format("record {0}-{0} ", lost));
    EXPECT_THAT(core_->describe_gaps(),
                testing::HasSubstr(fmt::format(
                    "1 samples missing, first sls/record batch {} of vehicle 0", lost)));
  }
}

// --- every event in every phase ------------------------------------------------------------------

TEST_F(RecordingCoreTest, EveryEventInEveryPhase) {
  struct Event {
    const char* name;
    std::function<void()> happen;
    const char *receiving, *whole;  // what comes out; of an ended recording nothing
  };
  const std::vector<Event> events = {
      {"step", [&] { core_->on_step(model::StepRecord()); }, "row0 ", ""},
      {"batch", [&] { core_->on_batch(make_batch(0, {make_entry(0)}), at(0)); }, "row0 ", ""},
      {"status", [&] { tell(kRunning, 9); }, "status0 ", "status2 "},
      {"library", [&] { core_->on_library("pilot", "a"); }, "", ""},
      {"time", [&] { core_->on_time(at(200)); }, "flush ", "flush "},
      {"end", [&] { end("gone"); }, "<recorder: gone> ", ""},
  };
  for (const Phase phase : {Phase::kReceiving, Phase::kWhole, Phase::kEnded})
    for (const Event& event : events) {
      begin();
      if (phase != Phase::kReceiving) fly_to_the_end();
      if (phase == Phase::kEnded) end();
      said_.clear();
      event.happen();
      EXPECT_EQ(said(), phase == Phase::kReceiving ? event.receiving
                        : phase == Phase::kWhole   ? event.whole
                                                   : "")
          << event.name << " in phase " << static_cast<int>(phase);
      EXPECT_EQ(core_->phase(), event.name == std::string("end") ? Phase::kEnded : phase);
    }
}

}  // namespace
}  // namespace sls::record
