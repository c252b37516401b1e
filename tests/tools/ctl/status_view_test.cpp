#include "tools/ctl/status_view.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "common/bus/sync_counters.hpp"

namespace sls::ctl {
namespace {

Participant make_participant(ParticipantRole role, const std::string& name,
                             const std::string& host) {
  Participant participant;
  participant.role(role);
  participant.name(name);
  participant.host(host);
  participant.ready(true);
  participant.last_complete_step(12344);
  return participant;
}

Snapshot make_snapshot() {
  Snapshot snapshot;
  snapshot.vehicle_id = 2;
  Parameters& parameters = snapshot.parameters;
  parameters.run_id(0x00c0ffee12345678);
  parameters.scenario_text("vehicle: { quad_mass_kg: 1.5 }\nname: figure_eight  # the eight\n");
  parameters.period_ns(4'000'000);
  parameters.mode(SyncMode::MODE_LOCKSTEP);
  SimStatus& status = snapshot.status.emplace();
  status.phase(RunPhase::PHASE_PAUSED);
  status.reason("paused by anna@ground");
  status.step(12345);
  status.real_time_factor(12.345);
  status.round_trip_p50_ns(108'400);
  status.round_trip_p99_ns(2'310'000);
  status.timing("exact");
  status.counters().resent(3);
  status.counters().duplicate(2);
  snapshot.participants = {make_participant(ParticipantRole::ROLE_CONTROLLER, "pilot", "ground"),
                           make_participant(ParticipantRole::ROLE_RECORDER, "tape", "shelf")};
  snapshot.participants[0].strength(-5);
  snapshot.participants[1].ready(false);
  snapshot.participants[1].last_complete_step(-1);
  return snapshot;
}

std::string join(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

/// Number of characters, not bytes; the texts here have no combining characters.
std::size_t count_characters(const std::string& text) {
  std::size_t count = 0;
  for (const char letter : text) count += (static_cast<unsigned char>(letter) & 0xc0) != 0x80;
  return count;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(StatusViewTest, ShowsTheWholeRun) {
  EXPECT_EQ(join(render(make_snapshot(), 80)),
            "figure_eight, vehicle 2, run 00c0ffee12345678, lockstep, period 0.004 s\n"
            "phase       paused: paused by anna@ground\n"
            "time        step 12345   49.380 s simulated\n"
            "pace        real-time factor 12.3   target none\n"
            "timing      exact\n"
            "round trip  p50 108 µs   p99 2.3 ms\n"
            "answers     resent 3   late 0   held 0   fail-safe 0   stale 0   duplicate 2\n"
            "            superseded 0   take-overs 0\n"
            "rejected    0\n"
            "\n"
            "role        name   host    strength  ready  last step\n"
            "controller  pilot  ground  -5        yes    12344\n"
            "recorder    tape   shelf   -         no     -\n");
}

TEST(StatusViewTest, NamesTheCausesOfRejectionAndTrouble) {
  Snapshot snapshot = make_snapshot();
  SyncCounters& counters = snapshot.status->counters();
  counters.rejected_not_finite(1);
  counters.rejected_run(20);
  counters.overflow(4);
  const std::string text = join(render(snapshot, 80));
  EXPECT_TRUE(contains(text, "rejected    21   not finite 1   run 20\n")) << text;
  EXPECT_TRUE(contains(text, "trouble     overflow 4\n")) << text;
}

TEST(StatusViewTest, EveryCounterIsShown) {
  Snapshot snapshot = make_snapshot();
  SyncCounters& counters = snapshot.status->counters();
  std::uint64_t value = 7000;
  for (const bus::SyncCounter& counter : bus::kSyncCounters) (counters.*counter.change)() = value++;
  const std::string text = join(render(snapshot, 80)), json = to_json(snapshot);
  for (std::uint64_t shown = 7000; shown < value; ++shown) {
    EXPECT_TRUE(contains(text, " " + std::to_string(shown))) << shown << "\n" << text;
    EXPECT_TRUE(contains(json, ":" + std::to_string(shown))) << shown << "\n" << json;
  }
}

TEST(StatusViewTest, InRealTimeTheWantedFactorIsShown) {
  Snapshot snapshot = make_snapshot();
  snapshot.parameters.mode(SyncMode::MODE_REALTIME);
  snapshot.parameters.real_time_factor(0.5);
  snapshot.status->real_time_factor(0.4987);
  EXPECT_TRUE(contains(join(render(snapshot, 80)), "real-time factor 0.499   target 0.5"));
}

TEST(StatusViewTest, ASilentServerIsNamedUntilTheRunHasEnded) {
  Snapshot snapshot = make_snapshot();
  snapshot.silence_s = 0.9;
  EXPECT_FALSE(contains(join(render(snapshot, 80)), "silent"));
  snapshot.silence_s = 2.31;
  EXPECT_TRUE(contains(join(render(snapshot, 80)), "server silent for 2.3 s\n"));
  EXPECT_TRUE(contains(render_line(snapshot), "server silent for 2.3 s"));
  snapshot.server_is_gone = true;
  EXPECT_TRUE(contains(join(render(snapshot, 80)), "server gone, silent for 2.3 s\n"));
  for (const auto phase : {RunPhase::PHASE_FINISHED, RunPhase::PHASE_FAILED}) {
    snapshot.status->phase(phase);
    EXPECT_FALSE(contains(join(render(snapshot, 80)), "silent"));
  }
}

TEST(StatusViewTest, OnlyFinishedAndFailedRunsHaveEnded) {
  Snapshot snapshot = make_snapshot();
  for (const auto phase : {RunPhase::PHASE_WAITING, RunPhase::PHASE_RUNNING, RunPhase::PHASE_PAUSED,
                           RunPhase::PHASE_RESET}) {
    snapshot.status->phase(phase);
    EXPECT_FALSE(has_ended(snapshot.status));
  }
  for (const auto phase : {RunPhase::PHASE_FINISHED, RunPhase::PHASE_FAILED}) {
    snapshot.status->phase(phase);
    EXPECT_TRUE(has_ended(snapshot.status));
  }
  EXPECT_FALSE(has_ended(std::nullopt));
}

TEST(StatusViewTest, AParticipantsMistakeIsShown) {
  Snapshot snapshot = make_snapshot();
  const std::string problem =
      "sls/command of 'foo' (10.0.0.2): DEADLINE: offered none, asked 0.1 s";
  EXPECT_EQ(nlohmann::json::parse(to_json(snapshot)).at("problem"), "");
  EXPECT_FALSE(contains(render_line(snapshot), "problem"));
  snapshot.status->problem(problem);
  EXPECT_EQ(nlohmann::json::parse(to_json(snapshot)).at("problem"), problem);
  EXPECT_TRUE(contains(render_line(snapshot), " | problem: " + problem));
  EXPECT_TRUE(contains(join(render(snapshot, 120)), "\nproblem     " + problem + "\n"));
}

TEST(StatusViewTest, LongReasonsAreWrappedBetweenWords) {
  Snapshot snapshot = make_snapshot();
  snapshot.status->reason(
      "waiting for: recorder 'tape' on shelf (2500 steps behind), controller 'pilot' on ground");
  const auto lines = render(snapshot, 60);
  EXPECT_EQ(lines[1], "phase       paused: waiting for: recorder 'tape' on shelf");
  EXPECT_EQ(lines[2], "            (2500 steps behind), controller 'pilot' on");
  EXPECT_EQ(lines[3], "            ground");
}

TEST(StatusViewTest, EventsAreShownBeyondTheirStatusButNotTwice) {
  Snapshot snapshot = make_snapshot();
  snapshot.events = {"step 0: missing: recorder", "step 12345: paused by anna@ground"};
  EXPECT_TRUE(contains(join(render(snapshot, 80)), "events      step 0: missing: recorder\n\n"));
  snapshot.status->reason("");
  EXPECT_TRUE(contains(join(render(snapshot, 80)), "phase       paused\n"));
  EXPECT_TRUE(contains(join(render(snapshot, 80)),
                       "events      step 0: missing: recorder\n"
                       "            step 12345: paused by anna@ground\n\n"));
}

TEST(StatusViewTest, LongNamesAreShortenedToTheTerminalsWidth) {
  Snapshot snapshot = make_snapshot();
  snapshot.participants[0] = make_participant(ParticipantRole::ROLE_CONTROLLER,
                                              std::string(32, 'n'), std::string(64, 'h'));
  const auto lines = render(snapshot, 80);
  EXPECT_EQ(lines[lines.size() - 2],
            "controller  nnnnnnnnnnnnnnnnnn…  hhhhhhhhhhhhhhhhhh…  0         yes    12344");
  EXPECT_TRUE(contains(join(render(snapshot, 160)), std::string(64, 'h')));
}

TEST(StatusViewTest, NoLineIsLongerThanTheTerminalIsWide) {
  Snapshot snapshot = make_snapshot();
  snapshot.status->reason(std::string(200, 'r'));
  snapshot.status->timing("degraded: überlastet, " + std::string(100, 't'));
  snapshot.silence_s = 12345.6;
  snapshot.participants[0] = make_participant(ParticipantRole::ROLE_CONTROLLER,
                                              std::string(32, 'n'), std::string(64, 'h'));
  snapshot.participants[0].strength(std::numeric_limits<std::int32_t>::min());
  snapshot.participants[0].last_complete_step(std::numeric_limits<std::int64_t>::max());
  for (std::size_t columns = 0; columns <= 200; ++columns)
    for (const std::string& line : render(snapshot, columns))
      ASSERT_LE(count_characters(line), columns) << line;
}

TEST(StatusViewTest, TerminalControlCharactersAreNotPassedOn) {
  Snapshot snapshot = make_snapshot();
  snapshot.status->reason("a\nb\x1b[2J\xc2\x9b\xff\xc3");
  snapshot.participants[0].name("p\xc3\xa4r\x07\xe2\x82");
  const std::string text = join(render(snapshot, 80));
  EXPECT_TRUE(contains(text, "paused: a?b?[2J???\n")) << text;
  EXPECT_TRUE(contains(text, " pär??? ")) << text;
  EXPECT_TRUE(contains(render_line(snapshot), "paused: a?b?[2J??? "));
  EXPECT_TRUE(nlohmann::json::accept(to_json(snapshot)));
}

TEST(StatusViewTest, ValuesOfANewerVersionReadUnknown) {
  Snapshot snapshot = make_snapshot();
  snapshot.status->phase(static_cast<RunPhase>(77));
  snapshot.status->reason("");
  snapshot.parameters.mode(static_cast<SyncMode>(77));
  snapshot.participants[0].role(static_cast<ParticipantRole>(77));
  snapshot.parameters.scenario_text("name: [of another, kind");
  const std::string text = join(render(snapshot, 80));
  EXPECT_TRUE(contains(text, "phase       unknown\n")) << text;
  EXPECT_TRUE(contains(text, "unnamed scenario, vehicle 2, run 00c0ffee12345678, unknown")) << text;
  EXPECT_TRUE(contains(text, "\nunknown   pilot")) << text;
}

TEST(StatusViewTest, ARunWithoutStatusParticipantsAndRoundTripsIsShownToo) {
  Snapshot snapshot = make_snapshot();
  snapshot.participants.clear();
  snapshot.status->round_trip_p50_ns(0);
  snapshot.status->round_trip_p99_ns(0);
  EXPECT_TRUE(contains(join(render(snapshot, 80)), "round trip  p50 -   p99 -\n"));
  EXPECT_TRUE(contains(join(render(snapshot, 80)), "\nno participants\n"));
  snapshot.status.reset();
  EXPECT_TRUE(contains(join(render(snapshot, 80)), "no status yet"));
  EXPECT_EQ(render_line(snapshot), "figure_eight 00c0ffee12345678");
  EXPECT_TRUE(nlohmann::json::accept(to_json(snapshot)));
}

TEST(StatusViewTest, OneLineHoldsTheEssence) {
  Snapshot snapshot = make_snapshot();
  snapshot.status->counters().rejected_step(9);
  EXPECT_EQ(render_line(snapshot),
            "figure_eight 00c0ffee12345678 | paused: paused by anna@ground | step 12345 | 49.380 s "
            "| factor 12.3 | round trip 108 µs / 2.3 ms | resent 3 | duplicate 2 | rejected 9");
}

TEST(StatusViewTest, JsonHoldsTheNumbers) {
  const auto json = nlohmann::json::parse(to_json(make_snapshot()));
  EXPECT_EQ(json.at("scenario"), "figure_eight");
  EXPECT_EQ(json.at("run_id"), "00c0ffee12345678");
  EXPECT_EQ(json.at("vehicle_id"), 2);
  EXPECT_EQ(json.at("phase"), "paused");
  EXPECT_EQ(json.at("step"), 12345);
  EXPECT_DOUBLE_EQ(json.at("sim_time_s"), 49.38);
  EXPECT_TRUE(json.at("real_time_factor_wanted").is_null());
  EXPECT_EQ(json.at("round_trip_p50_ns"), 108400);
  EXPECT_EQ(json.at("counters").at("resent"), 3);
  EXPECT_EQ(json.at("counters").at("fail_safe"), 0);
  EXPECT_EQ(json.at("rejected").at("not_finite"), 0);
  EXPECT_EQ(json.at("participants").size(), 2u);
  EXPECT_EQ(json.at("participants")[0].at("strength"), -5);
  EXPECT_FALSE(contains(to_json(make_snapshot()), "\n"));
}

}  // namespace
}  // namespace sls::ctl
