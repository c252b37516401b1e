#include "recorder/core/recorder_core.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/common/sync/samples.hpp"

namespace sls::record {
namespace {

using namespace sync;

const std::string kRunText = "00000000000001f4", kNextRunText = "00000000000001f5";

/// A recorder of vehicle 4 into "out". A server that is silent for 7 s is lost.
class RecorderCoreTest : public testing::Test {
 protected:
  using Act = RecorderCore::Act;
  using Phase = RecorderCore::Phase;
  using Place = RecorderCore::Place;
  static constexpr auto kServer = peer(2), kReplacement = peer(3);

  RecorderCoreTest() {
    options_.folder = "out";
    options_.vehicle = kVehicle;
    begin();
  }

  /// A new recorder with `options_`, and no server yet.
  void begin() {
    core_.emplace(options_);
    servers_.emplace(peer(1)).set_present({kServer, kReplacement});
    said_.clear();
  }
  void serve(std::uint64_t run_id, const bus::PeerId& server, std::int64_t ms,
             RunPhase phase = RunPhase::PHASE_RUNNING) {
    servers_->note(claim(run_id, {3, kVehicle}), server, at(ms));
    servers_->note(status(run_id, phase), server, at(ms));
  }

  Act look(std::int64_t ms, const std::string& interruption = "", bool is_closed = false,
           std::int64_t step = 5) {
    const Act act = core_->look(*servers_, {{at(ms), interruption, true, step}, is_closed});
    note_lines();
    return act;
  }
  /// Looks every 20 ms until there is something to do, the last time before `ms`.
  Act look_from(std::int64_t now, std::int64_t ms) {
    Act act = Act::kNone;
    for (; act == Act::kNone && now < ms; now += 20) act = look(now);
    return act;
  }
  void open(std::int64_t ms) {
    ASSERT_EQ(look(ms), Act::kOpen);
    core_->on_opened(7, {at(ms), "", false, -1});
    EXPECT_EQ(core_->phase(), Phase::kRecording);
  }
  /// Records run kRun, which ends by itself.
  void record(std::int64_t ms) {
    serve(kRun, kServer, ms);
    open(ms);
    ASSERT_EQ(look(ms, "", true), Act::kReport);
  }
  void report(const RecorderCore::Recorded& recorded, const std::string& interruption = "") {
    core_->on_recorded(recorded, interruption);
    note_lines();
  }
  void note_lines() {
    for (const Line& line : core_->take_lines())
      said_ += (line.is_warning ? "W " : "I ") + line.text + "\n";
  }

  const RecorderCore::Recorded whole_{true, false, "", 5}, cut_{false, false, "a gap", 5},
      reset_{false, true, "run reset", 5};
  RecorderCore::Options options_;
  std::optional<Servers> servers_;
  std::optional<RecorderCore> core_;
  std::string said_;
};

// --- the first run -------------------------------------------------------------------------------

TEST_F(RecorderCoreTest, WaitsAMinuteForAServerAndSaysSo) {
  EXPECT_EQ(look(0), Act::kNone);
  EXPECT_FALSE(core_->is_ready());
  EXPECT_EQ(core_->next_deadline(), at(5));
  look(1499);
  EXPECT_EQ(said_, "");
  look(1500);
  EXPECT_EQ(said_, "I waiting for: server (58 s left)\n");
  look(59'999);
  EXPECT_EQ(core_->phase(), Phase::kFinding);
  EXPECT_EQ(look(60'000), Act::kNone);
  EXPECT_EQ(core_->phase(), Phase::kEnded);
  EXPECT_EQ(core_->error(), "out: nothing recorded: no server within 60 s");
}

TEST_F(RecorderCoreTest, EachWaitForARunHasItsOwnTime) {
  look(0);
  record(59'000);
  report(reset_);
  look(60'500);
  EXPECT_EQ(core_->phase(), Phase::kFinding);
}

TEST_F(RecorderCoreTest, AStopBeforeARunIsNoError) {
  serve(kRun, kServer, 0);
  EXPECT_EQ(look(0, "interrupted by SIGINT"), Act::kNone);
  EXPECT_EQ(core_->phase(), Phase::kEnded);
  EXPECT_EQ(core_->error(), "");
}

TEST_F(RecorderCoreTest, RecordsTheRunWithItsVehicle) {
  servers_->note(claim(kRun, {3}), kServer, at(0));
  servers_->note(status(kRun, RunPhase::PHASE_RUNNING), kServer, at(0));
  EXPECT_EQ(look(0), Act::kNone);
  serve(kRun + 1, kReplacement, 0);
  open(20);
  EXPECT_EQ(core_->place(), Place::kFolder);
  EXPECT_EQ(core_->run()->server, kReplacement);
}

// --- one run -------------------------------------------------------------------------------------

TEST_F(RecorderCoreTest, AnnouncesTheRunThatItRecords) {
  options_.identity.host("here");
  begin();
  const auto is = [this](std::uint64_t run_id, bool is_ready, bool is_done) {
    const Participant message = core_->make_announcement(5, false);
    return message.name() == "recorder" && message.host() == "here" &&
           message.role() == ParticipantRole::ROLE_RECORDER && message.run_id() == run_id &&
           message.last_complete_step() == 5 && message.ready() == is_ready &&
           message.done() == is_done;
  };
  EXPECT_TRUE(is(0, false, false)) << "while it looks for a server";
  serve(kRun, kServer, 0);
  ASSERT_EQ(look(0), Act::kOpen);
  EXPECT_TRUE(is(kRun, false, false));
  core_->on_opened(7, {at(0), "", false, -1});
  EXPECT_EQ(look(5), Act::kAnnounce);
  EXPECT_TRUE(is(kRun, true, false));
  EXPECT_FALSE(core_->make_announcement(5, true).ready()) << "it cannot write";
  EXPECT_EQ(look(10, "", true), Act::kReport);
  EXPECT_TRUE(is(kRun, true, true));
  report(whole_);
  EXPECT_TRUE(is(0, true, false));
}

TEST_F(RecorderCoreTest, AnnouncesUntilTheRecordingIsClosed) {
  serve(kRun, kServer, 0);
  open(0);
  EXPECT_FALSE(core_->is_ready());
  EXPECT_EQ(look(5), Act::kAnnounce) << "it hears the server";
  EXPECT_TRUE(core_->is_ready());
  EXPECT_EQ(look(500), Act::kNone);
  EXPECT_EQ(look(505), Act::kAnnounce);
  servers_->note(status(kRun, RunPhase::PHASE_FAILED), kServer, at(510));
  EXPECT_EQ(look(510), Act::kNone);
  EXPECT_EQ(look(1509), Act::kAnnounce);
  EXPECT_EQ(look(1510), Act::kClose) << "1 s for the rest";
  EXPECT_EQ(look(2008), Act::kNone);
  EXPECT_EQ(look(2009), Act::kAnnounce) << "a slow disk stops no announcement";
  EXPECT_EQ(look(2010, "", true), Act::kReport);
  EXPECT_EQ(look(9000), Act::kNone);
  report(cut_);
  EXPECT_EQ(core_->phase(), Phase::kEnded);
  EXPECT_EQ(core_->error(), "out: not complete: a gap");
}

TEST_F(RecorderCoreTest, EndsWithACompleteRecording) {
  record(0);
  report(whole_, "interrupted by SIGTERM");
  EXPECT_EQ(core_->phase(), Phase::kEnded);
  EXPECT_EQ(core_->error(), "");
  EXPECT_EQ(said_, "I out: complete, 5 steps\n");
}

// --- the next run --------------------------------------------------------------------------------

TEST_F(RecorderCoreTest, RecordsTheRunAfterAResetIntoASubfolder) {
  record(0);
  report(reset_);
  EXPECT_EQ(said_, "I out: run " + kRunText + " ended by a reset: run reset\n");
  EXPECT_EQ(look(20), Act::kNone);
  serve(kRun + 1, kServer, 40, RunPhase::PHASE_WAITING);
  open(40);
  EXPECT_EQ(core_->place(), Place::kSubfolder);
  EXPECT_EQ(core_->run()->parameters.run_id(), kRun + 1);
}

TEST_F(RecorderCoreTest, ARunWhoseServerHasBegunAnotherOneWasResetAlsoWithoutAStatusThatSaysSo) {
  serve(kRun, kServer, 0);
  open(0);
  serve(kRun + 1, kServer, 1500);
  Act act = Act::kNone;
  for (std::int64_t ms = 20; act != Act::kClose && ms < 9000; ms += 20) act = look(ms);
  EXPECT_EQ(look(2020, "", true), Act::kReport);
  report(cut_);
  EXPECT_NE(said_.find("I out: run " + kRunText + " ended by a reset: a gap\n"), said_.npos);
  open(2040);
  EXPECT_EQ(core_->run()->parameters.run_id(), kRun + 1);
}

TEST_F(RecorderCoreTest, TheRunAfterAResetIsWaitedForAsLongAsASilentServer) {
  record(0);
  report(reset_);
  said_.clear();
  look(20);
  look(1520);
  EXPECT_EQ(said_, "I waiting for: the run after the reset of run " + kRunText + " (6 s left)\n");
  look(7019);
  EXPECT_EQ(core_->phase(), Phase::kFinding);
  look(7020);
  EXPECT_EQ(core_->error(), "out: no run within 7 s of the reset of run " + kRunText);
}

TEST_F(RecorderCoreTest, NoRunIsWaitedForAfterAResetThatFailed) {
  record(0);
  report(reset_);
  SimStatus failed = status(kRun, RunPhase::PHASE_FAILED);
  failed.reason("no thread");
  servers_->note(failed, kServer, at(20));
  EXPECT_EQ(look(20), Act::kNone);
  EXPECT_EQ(core_->phase(), Phase::kEnded);
  EXPECT_EQ(core_->error(), "out: no run after the reset of run " + kRunText + ": no thread");
}

TEST_F(RecorderCoreTest, AStopAfterAResetEndsItWithItsGaps) {
  record(0);
  report(reset_, "interrupted by SIGINT");
  EXPECT_EQ(core_->error(), "out: not complete: run reset");
  begin();
  record(0);
  report(reset_);
  look(20, "interrupted by SIGINT");
  EXPECT_EQ(core_->phase(), Phase::kEnded);
  EXPECT_EQ(core_->error(), "") << "the reset run is reported already";
}

TEST_F(RecorderCoreTest, AReplacementIsFollowedOnlyIfThatIsWanted) {
  for (const bool follows : {false, true}) {
    options_.follows_servers = follows;
    begin();
    serve(kRun, kServer, 0);
    open(0);
    look(5);
    look_from(1000, 1500);
    serve(kRun + 1, kReplacement, 1500, RunPhase::PHASE_WAITING);
    Act act = Act::kNone;
    for (std::int64_t ms = 1500; act != Act::kClose && ms < 9000; ms += 20) act = look(ms);
    EXPECT_EQ(act, Act::kClose);
    EXPECT_EQ(look(9000, "", true), Act::kReport);
    report(cut_);
    EXPECT_EQ(core_->error(), follows ? "" : "out: not complete: a gap");
    if (follows) {
      EXPECT_NE(said_.find("W out: not complete: a gap\n"), said_.npos);
      EXPECT_EQ(look(9000), Act::kNone) << "it has died since";
      serve(kRun + 1, kReplacement, 9000, RunPhase::PHASE_FINISHED);
      EXPECT_EQ(look(9000), Act::kOpen) << "it lives, and its run is over already";
      EXPECT_EQ(core_->run()->server, kReplacement);
      EXPECT_EQ(core_->place(), Place::kSubfolder);
    }
  }
}

TEST_F(RecorderCoreTest, AfterAResetOnlyAFollowerTakesTheRunOfAnotherServer) {
  for (const bool follows : {false, true}) {
    options_.follows_servers = follows;
    begin();
    record(0);
    report(reset_);
    serve(kRun + 1, kReplacement, 1000, RunPhase::PHASE_WAITING);
    EXPECT_EQ(look_from(1000, 4000), follows ? Act::kOpen : Act::kNone) << "its server is silent";
  }
}

// --- a recording to be continued -----------------------------------------------------------------

TEST_F(RecorderCoreTest, AnUnfinishedRecordingIsContinuedWhereItsRunBelongs) {
  struct Case {
    const char* what;
    std::string run_id, outcome;
    bool follows, has_subfolder;
    std::optional<Place> place;
  };
  for (const Case& given : std::vector<Case>{
           {"its own run", kRunText, "recording", false, false, Place::kNextSegment},
           {"another server's", kNextRunText, "lost", false, false, std::nullopt},
           {"the same, followed", kNextRunText, "lost", true, false, Place::kSubfolder},
           {"a further run begun earlier", kNextRunText, "lost", false, true, Place::kSubfolder},
           {"the run after a reset", kNextRunText, "reset", false, false, Place::kSubfolder},
       }) {
    options_.unfinished = {given.run_id, given.outcome, {kVehicle}};
    options_.follows_servers = given.follows;
    options_.has_subfolder = [&](std::uint64_t) { return given.has_subfolder; };
    begin();
    look(0);
    look(1500);
    EXPECT_EQ(said_, "I waiting for: server of run " + given.run_id + " (58 s left)\n");
    serve(kRun, kServer, 1520);
    EXPECT_EQ(look(1520), given.place ? Act::kOpen : Act::kNone) << given.what;
    if (given.place) {
      EXPECT_EQ(core_->place(), *given.place) << given.what;
    } else {
      EXPECT_EQ(core_->error(), "out: run " + kNextRunText + " was replaced by run " + kRunText +
                                    ": expected the one that is to be resumed (--follow records "
                                    "the other one into a subfolder)");
    }
  }
}

TEST_F(RecorderCoreTest, ItsRunIsRecordedEvenIfItHasJustEnded) {
  for (const bool is_unfinished : {false, true}) {
    if (is_unfinished) options_.unfinished = {kRunText, "recording", {kVehicle}};
    begin();
    serve(kRun, kServer, 0, RunPhase::PHASE_FINISHED);
    EXPECT_EQ(look(0), is_unfinished ? Act::kOpen : Act::kNone);
  }
}

TEST_F(RecorderCoreTest, ItsVehiclesCountMoreThanTheOption) {
  options_.vehicle = 7;
  EXPECT_EQ(RecorderCore(options_).vehicle(), 7u);
  options_.unfinished = {kRunText, "recording", {3, 7}};
  EXPECT_EQ(RecorderCore(options_).vehicle(), 7u);
  options_.unfinished->vehicle_ids = {3, 4};
  EXPECT_EQ(RecorderCore(options_).vehicle(), 3u);
  options_.unfinished->vehicle_ids = {};
  EXPECT_EQ(RecorderCore(options_).vehicle(), 7u);
}

// --- every event in every phase ------------------------------------------------------------------

TEST_F(RecorderCoreTest, EveryEventInEveryPhase) {
  const std::vector<std::function<void()>> steps = {[&] { serve(kRun, kServer, 0); },
                                                    [&] { look(0); },
                                                    [&] {
                                                      core_->on_opened(7, {at(0), "", true, 5});
                                                    },
                                                    [&] { look(0, "stop"), look(500, "stop"); },
                                                    [&] { look(500, "", true); },
                                                    [&] { report(whole_); }};
  enum Event { kLook, kStop, kClosed, kOpened, kRecorded };
  // For each phase, in which each event leaves it.
  using P = Phase;
  const Phase after[][5] = {
      {P::kOpening, P::kEnded, P::kOpening, P::kFinding, P::kFinding},
      {P::kOpening, P::kOpening, P::kOpening, P::kRecording, P::kOpening},
      {P::kRecording, P::kRecording, P::kClosed, P::kRecording, P::kRecording},
      {P::kClosing, P::kClosing, P::kClosed, P::kClosing, P::kClosing},
      {P::kClosed, P::kClosed, P::kClosed, P::kClosed, P::kEnded},
      {P::kEnded, P::kEnded, P::kEnded, P::kEnded, P::kEnded},
  };
  for (int phase = 0; phase < 6; ++phase)
    for (const Event event : {kLook, kStop, kClosed, kOpened, kRecorded}) {
      begin();
      for (int i = 0; i <= phase; ++i) steps[i]();
      ASSERT_EQ(core_->phase(), static_cast<Phase>(phase));
      if (event == kLook) look(500);
      if (event == kStop) look(500, "stop");
      if (event == kClosed) look(500, "", true);
      if (event == kOpened) core_->on_opened(7, {at(500), "", true, 5});
      if (event == kRecorded) report(cut_);
      EXPECT_EQ(core_->phase(), after[phase][event]) << "event " << event << ", phase " << phase;
    }
}

}  // namespace
}  // namespace sls::record
