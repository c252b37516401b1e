#include "sim_server/core/participants/participant_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

#include "common/bus/topics.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kRun = 0xab;
const std::string kScenario(64, 'a');

config::Scenario make_scenario() {
  config::Scenario scenario;
  scenario.sha256 = kScenario;
  return scenario;
}

bus::PeerId make_peer(std::uint8_t number) {
  bus::PeerId peer;
  peer.bytes.fill(number);
  return peer;
}

sync::Member make_entry(std::uint8_t number, const std::string& name = "foo",
                        ParticipantRole role = ParticipantRole::ROLE_CONTROLLER) {
  sync::Member entry;
  entry.peer = make_peer(number);
  entry.announcement.run_id(kRun);
  entry.announcement.contract_sha256(bus::kContractSha256);
  entry.announcement.role(role);
  entry.announcement.name(name);
  entry.announcement.host("box");
  entry.announcement.vehicle_ids({0, 1});
  entry.announcement.scenario_sha256(kScenario);
  entry.announcement.ready(true);
  entry.ready_since = sync::Time(std::chrono::seconds(number));
  return entry;
}

class ParticipantCheckTest : public testing::Test {
 protected:
  std::vector<std::string> look(std::chrono::milliseconds time = 0ms) {
    neighbourhood_.now = sync::Time(1h + time);
    if (are_matched_)
      for (const sync::Member& entry : neighbourhood_.participants) {
        if (entry.announcement.role() != ParticipantRole::ROLE_CONTROLLER) continue;
        neighbourhood_.state_readers.insert(entry.peer);
        neighbourhood_.command_writers.emplace(entry.peer, "'foo' (10.0.0.2)");
      }
    std::vector<std::string> texts;
    for (const auto& [key, text] : check_.look(neighbourhood_)) texts.push_back(text);
    return texts;
  }
  std::vector<std::string> only(const std::string& text) { return {text}; }

  static OfferedAnswer make_answer(std::uint64_t step) {
    OfferedAnswer answer;
    answer.run_id = kRun;
    answer.step = step;
    answer.client_name = "foo";
    return answer;
  }
  void take(const OfferedAnswer& answer, Verdict verdict = Verdict::kAccepted) {
    check_.answers().note_taken(answer, make_peer(1), verdict);
  }
  void reject(const OfferedAnswer& answer, Verdict verdict, std::uint64_t step) {
    check_.answers().note_rejected(answer, make_peer(1), verdict, step);
  }

  ParticipantCheck check_{kRun, make_scenario(), {0, 1}};
  Neighbourhood neighbourhood_;
  bool are_matched_ = true;  // the endpoints of every controller
};

const std::string kFoo = "controller 'foo' on box: ";

// --- announcements -------------------------------------------------------------------------------

TEST_F(ParticipantCheckTest, OursDoNothingWrong) {
  neighbourhood_.participants = {make_entry(1),
                                 make_entry(2, "tape", ParticipantRole::ROLE_RECORDER)};
  neighbourhood_.command_writers[make_peer(1)] = "'foo' (10.0.0.2)";
  for (int i = 0; i < 10; ++i) EXPECT_EQ(look(i * 1s), std::vector<std::string>());
  EXPECT_EQ(check_.admit_controllers(neighbourhood_.participants).size(), 2u);
}

TEST_F(ParticipantCheckTest, AnotherContractIsNamedAtOnceAndNotAdmitted) {
  auto controller = make_entry(1), recorder = make_entry(2, "tape", ParticipantRole::ROLE_RECORDER);
  controller.announcement.contract_sha256(std::string(64, '1'));
  recorder.announcement.contract_sha256("");
  controller.announcement.vehicle_ids({99});  // may have another meaning there
  neighbourhood_.participants = {controller, recorder};
  const std::string field = "sls/participant contract_sha256: expected ";
  EXPECT_EQ(look(), (std::vector<std::string>{
                        kFoo + field + bus::kContractSha256 + ", got " + std::string(64, '1'),
                        "recorder 'tape' on box: " + field + bus::kContractSha256 + ", got none"}));
  EXPECT_TRUE(check_.admit_controllers({controller}).empty());
  EXPECT_TRUE(ParticipantCheck::admit_recorders({recorder}).empty());
}

TEST_F(ParticipantCheckTest, AnUnknownRunIsReportedOnceItLasts) {
  auto entry = make_entry(1);
  entry.announcement.run_id(0xcd);
  neighbourhood_.participants = {entry};
  EXPECT_TRUE(look().empty());
  EXPECT_TRUE(look(3900ms).empty());
  const auto expected =
      only(kFoo + "sls/participant run_id: expected 00000000000000ab, got 00000000000000cd");
  EXPECT_EQ(look(4s), expected);
  EXPECT_EQ(look(9s), expected);
  neighbourhood_.participants = {make_entry(1)};
  EXPECT_TRUE(look(10s).empty());
}

TEST_F(ParticipantCheckTest, ARunOfZeroIsNamedOnceItLasts) {
  auto entry = make_entry(1);
  entry.announcement.run_id(0);
  neighbourhood_.participants = {entry};
  EXPECT_TRUE(look().empty());
  const auto expected = only(kFoo + "sls/participant run_id: expected 00000000000000ab, got 0");
  EXPECT_EQ(look(4s), expected);
  neighbourhood_.participants[0].announcement.vehicle_ids({7});
  EXPECT_TRUE(look(5s).empty()) << "it may wait for another server";
  neighbourhood_.participants[0].announcement.vehicle_ids({});
  look(6s);
  EXPECT_EQ(look(10s), expected);
}

TEST_F(ParticipantCheckTest, AControllerOfAnotherServerIsNotOurs) {
  auto other = make_entry(1), waits = make_entry(2);
  other.announcement.run_id(0xcd);
  other.announcement.vehicle_ids({7});
  other.announcement.scenario_sha256("");
  waits.announcement.run_id(0);
  waits.announcement.vehicle_ids({8});
  neighbourhood_.participants = {other, waits};
  neighbourhood_.other_runs = {0xcd};
  neighbourhood_.other_vehicles = {7};
  for (const std::uint8_t number : {1, 2})
    neighbourhood_.missing_deadlines[make_peer(number)] = "sls/command of 'foo': DEADLINE: …";
  look();
  EXPECT_TRUE(look(5s).empty());
}

TEST_F(ParticipantCheckTest, UnknownVehiclesAreReportedOnceTheyLast) {
  auto entry = make_entry(1);
  entry.announcement.vehicle_ids({1, 7, 8, 20});
  neighbourhood_.other_vehicles = {20};
  neighbourhood_.participants = {entry};
  EXPECT_TRUE(look().empty());
  EXPECT_EQ(look(4s), only(kFoo + "sls/participant vehicle_ids: expected 0-1, got 7-8"));
  entry.announcement.vehicle_ids({});
  neighbourhood_.participants = {entry};
  look(5s);
  EXPECT_EQ(look(9s), only(kFoo + "sls/participant vehicle_ids: expected 0-1, got none"));
}

TEST_F(ParticipantCheckTest, AnotherScenarioIsNamedWithBoth) {
  auto entry = make_entry(1);
  entry.announcement.scenario_sha256(std::string(64, 'b'));
  neighbourhood_.participants = {entry};
  EXPECT_EQ(look(), only(kFoo + "sls/participant scenario_sha256: expected " + kScenario +
                         ", got " + std::string(64, 'b')));
}

TEST_F(ParticipantCheckTest, ARoleThatIsNotDefinedIsNamed) {
  neighbourhood_.participants = {make_entry(1, "foo", static_cast<ParticipantRole>(7))};
  EXPECT_EQ(look(), only("participant 'foo' on box: sls/participant role: expected controller or "
                         "recorder, got 7"));
}

TEST_F(ParticipantCheckTest, ARecorderThatWritesCommandsIsNamed) {
  neighbourhood_.participants = {make_entry(1, "foo", ParticipantRole::ROLE_RECORDER)};
  EXPECT_TRUE(look().empty());
  neighbourhood_.command_writers[make_peer(1)] = "'foo' (10.0.0.2)";
  EXPECT_EQ(look(), only("recorder 'foo' on box: sls/participant role: expected controller, as it "
                         "writes sls/command, got recorder"));
}

TEST_F(ParticipantCheckTest, AClientThatIsNeverReadyIsNamedWithItsEndpoints) {
  auto entry = make_entry(1);
  entry.announcement.ready(false);
  neighbourhood_.participants = {entry};
  EXPECT_TRUE(look().empty());
  EXPECT_TRUE(look(3900ms).empty());
  EXPECT_EQ(look(4s), only(kFoo + "sls/participant ready: expected true, as its endpoints are "
                                  "matched, got false"));
  neighbourhood_.participants[0].announcement.ready(true);
  EXPECT_TRUE(look(5s).empty());
}

TEST_F(ParticipantCheckTest, AMissingEndpointIsNamed) {
  are_matched_ = false;
  neighbourhood_.participants = {make_entry(1)};
  look();
  EXPECT_EQ(look(4s), only(kFoo + "expected a reader of sls/state and a writer of sls/command, got "
                                  "none"));
  neighbourhood_.command_writers[make_peer(1)] = "'foo' (10.0.0.2)";
  EXPECT_TRUE(look(5s).empty());
  EXPECT_EQ(look(9s), only(kFoo + "expected a reader of sls/state, got none"));
  neighbourhood_.command_writers.clear();
  neighbourhood_.state_readers = {make_peer(1)};
  look(10s);
  EXPECT_EQ(look(14s), only(kFoo + "expected a writer of sls/command, got none"));
  neighbourhood_.explained = {make_peer(1)};  // its writer has other QoS: already reported
  EXPECT_TRUE(look(15s).empty());
}

TEST_F(ParticipantCheckTest, EndpointsAreWaitedForLongerOnANetwork) {
  are_matched_ = false;
  neighbourhood_.is_on_network = true;
  neighbourhood_.participants = {make_entry(1)};
  look();
  EXPECT_TRUE(look(14900ms).empty());
  EXPECT_EQ(look(15s).size(), 1u);
}

TEST_F(ParticipantCheckTest, ANameThatIsNotUtf8IsNamed) {
  neighbourhood_.participants = {make_entry(1, "f\xfc\xfc"), make_entry(2, "f\xc3\xbc")};
  EXPECT_EQ(look(), only("controller 'f\\xfc\\xfc' on box: sls/participant name: expected UTF-8, "
                         "got 'f\\xfc\\xfc'"));
}

TEST_F(ParticipantCheckTest, NamesAreShownPrintable) {
  auto entry = make_entry(1, "evil\n\x1b[2J");
  entry.announcement.run_id(0);
  neighbourhood_.participants = {entry};
  look();
  const auto found = look(4s);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].find_first_of("\n\x1b"), std::string::npos) << found[0];
}

// --- strangers -----------------------------------------------------------------------------------

TEST_F(ParticipantCheckTest, AWriterOfCommandsWithoutAnAnnouncementIsNamedOnceThatLasts) {
  neighbourhood_.command_writers[make_peer(1)] = "'foo' (10.0.0.2)";
  EXPECT_TRUE(look().empty());
  EXPECT_EQ(check_.next_due(), sync::Time(1h + 4s));
  EXPECT_TRUE(look(3900ms).empty());
  EXPECT_EQ(look(4s), only("'foo' (10.0.0.2): writes sls/command: expected an announcement in "
                           "sls/participant, got none"));
  neighbourhood_.explained = {make_peer(1)};  // its announcement does not fit: already reported
  EXPECT_TRUE(look(5s).empty());
}

TEST_F(ParticipantCheckTest, AnAnnouncementIsWaitedForLongerOnANetwork) {
  neighbourhood_.command_writers[make_peer(1)] = "'foo' (10.0.0.2)";
  neighbourhood_.is_on_network = true;
  EXPECT_TRUE(look().empty());
  EXPECT_TRUE(look(14900ms).empty());  // time for several losses in a row
  EXPECT_EQ(look(15s).size(), 1u);
  neighbourhood_.participants = {make_entry(1, "foo")};
  EXPECT_TRUE(look(16s).empty());
}

TEST_F(ParticipantCheckTest, AMissingDeadlineExplainsThatNoWriterMatches) {
  neighbourhood_.participants = {make_entry(1)};
  neighbourhood_.missing_deadlines[make_peer(1)] = "sls/command of 'foo': DEADLINE";
  EXPECT_EQ(look(), only("sls/command of 'foo': DEADLINE"));
  EXPECT_EQ(look(2s), only("sls/command of 'foo': DEADLINE"));
}

TEST_F(ParticipantCheckTest, AMissingDeadlineIsReportedOnlyOfOurControllers) {
  neighbourhood_.missing_deadlines[make_peer(1)] = "sls/command of 'foo': DEADLINE";
  EXPECT_TRUE(look().empty());  // without an announcement its vehicles are unknown
  EXPECT_EQ(look(4s), only("sls/command of 'foo': DEADLINE"));
  neighbourhood_.missing_deadlines = {{make_peer(2), "sls/command of 'bar': DEADLINE"}};
  neighbourhood_.participants = {make_entry(2, "bar")};
  EXPECT_EQ(look(5s), only("sls/command of 'bar': DEADLINE"));
  neighbourhood_.participants[0].announcement.run_id(0xcd);  // of the run before, perhaps
  EXPECT_TRUE(look(6s).empty());
  const auto found = look(10s);
  EXPECT_NE(std::find(found.begin(), found.end(), "sls/command of 'bar': DEADLINE"), found.end());
}

// --- libraries -----------------------------------------------------------------------------------

TEST_F(ParticipantCheckTest, AnotherLibraryThanThatOfTheFirstIsRefused) {
  auto first = make_entry(1, "first"), second = make_entry(2, "second");
  first.announcement.library_sha256(std::string(64, 'c'));
  neighbourhood_.participants = {second, first};
  const auto admitted = check_.admit_controllers(neighbourhood_.participants);
  ASSERT_EQ(admitted.size(), 1u);
  EXPECT_EQ(admitted[0].peer, first.peer);
  EXPECT_EQ(look(), only("controller 'second' on box: sls/participant library_sha256: expected " +
                         std::string(64, 'c') + " (that of 'first'), got none; it is refused"));
  // Before the first step another client may become the first.
  EXPECT_EQ(check_.admit_controllers({second}).size(), 1u);
  EXPECT_EQ(check_.admit_controllers({second, first}).size(), 1u);
}

TEST_F(ParticipantCheckTest, ALibraryBindsTheOthersOfItsVehicleIfItsClientCanFly) {
  auto first = make_entry(1, "first"), second = make_entry(2, "second");
  first.announcement.library_sha256(std::string(64, 'c'));
  first.announcement.vehicle_ids({0});
  const auto is_admitted = [&] { return check_.admit_controllers({first, second}).size() == 2; };
  EXPECT_FALSE(is_admitted());
  second.announcement.vehicle_ids({1});
  EXPECT_TRUE(is_admitted());
  second.announcement.vehicle_ids({0});
  first.announcement.ready(false);
  EXPECT_EQ(check_.admit_controllers({first, second}).at(0).peer, second.peer);
  first.announcement.ready(true);
  first.announcement.scenario_sha256("another");
  EXPECT_EQ(check_.admit_controllers({first, second}).at(0).peer, second.peer);
}

TEST_F(ParticipantCheckTest, TheLibraryOfAClientThatIsGoneBindsNobody) {
  auto dead = make_entry(1, "dead"), repaired = make_entry(2, "repaired");
  dead.announcement.library_sha256(std::string(64, 'c'));
  repaired.announcement.library_sha256(std::string(64, 'd'));
  dead.is_gone = true;
  neighbourhood_.participants = {dead, repaired};
  const auto admitted = check_.admit_controllers(neighbourhood_.participants);
  ASSERT_EQ(admitted.size(), 1u);
  EXPECT_EQ(admitted[0].peer, repaired.peer);
  EXPECT_TRUE(look().empty()) << "and nobody is refused by name";
}

TEST_F(ParticipantCheckTest, TheLibraryThatHasFlownStaysInForceWhenItsClientIsGone) {
  auto first = make_entry(1, "first"), second = make_entry(2, "second");
  first.announcement.library_sha256(std::string(64, 'c'));
  second.announcement.library_sha256(std::string(64, 'd'));
  check_.admit_controllers({first});
  take(make_answer(0));
  EXPECT_TRUE(check_.admit_controllers({second}).empty());
  first.peer = make_peer(3);  // restarted
  EXPECT_EQ(check_.admit_controllers({first, second}).size(), 1u);
}

// --- answers -------------------------------------------------------------------------------------

TEST_F(ParticipantCheckTest, AnswersThatAreAllRejectedAreNamedWithCauseAndCount) {
  neighbourhood_.participants = {make_entry(1)};
  OfferedAnswer answer = make_answer(5);
  answer.run_id = 0xcd;
  for (int i = 0; i < 3; ++i) reject(answer, Verdict::kOtherRun, 5);
  const std::string cause = "run_id: expected 00000000000000ab, got 00000000000000cd";
  EXPECT_EQ(check_.answers().describe_rejections(make_peer(1)),
            " (3 of its answers rejected, none taken: " + cause + ")");
  EXPECT_TRUE(look().empty());
  EXPECT_EQ(look(4s), only(kFoo + "sls/command: 3 answers rejected, none taken: " + cause));
  take(make_answer(5));
  EXPECT_TRUE(look(4100ms).empty());
  EXPECT_EQ(check_.answers().describe_rejections(make_peer(1)), "");
}

TEST_F(ParticipantCheckTest, CausesOfRejection) {
  neighbourhood_.participants = {make_entry(1)};
  look();
  OfferedAnswer answer = make_answer(5);
  answer.vehicle_id = 9;
  reject(answer, Verdict::kUnknownVehicle, 5);
  EXPECT_EQ(check_.answers().describe_rejections(make_peer(1)),
            " (1 of its answers rejected, none taken: vehicle_id: expected 0-1, got 9)");
  reject(make_answer(3), Verdict::kWrongStep, 500);
  EXPECT_EQ(check_.answers().describe_rejections(make_peer(1)),
            " (2 of its answers rejected, none taken: step: expected 500, got 3)");
}

TEST_F(ParticipantCheckTest, AFewAnswersToOldStepsAreNoMistake) {
  neighbourhood_.participants = {make_entry(1)};
  reject(make_answer(3), Verdict::kWrongStep, 500);
  reject(make_answer(4), Verdict::kWrongStep, 500);
  look();
  EXPECT_TRUE(look(5s).empty());
  reject(make_answer(5), Verdict::kWrongStep, 500);
  EXPECT_EQ(look(6s), only(kFoo + "sls/command: 3 answers rejected, none taken: step: expected "
                                  "500, got 5"));
}

TEST_F(ParticipantCheckTest, AnswersToStepsThatAreNotPublishedAreNamedAtOnceAndForATime) {
  neighbourhood_.participants = {make_entry(1)};
  reject(make_answer(13), Verdict::kWrongStep, 12);
  const auto expected =
      only(kFoo + "sls/command step: expected at most 12, the last published, got 13");
  EXPECT_EQ(look(), expected);
  EXPECT_EQ(look(2s), expected);
  EXPECT_TRUE(look(2001ms).empty() || look(2001ms)[0].find("rejected") != std::string::npos);
}

TEST_F(ParticipantCheckTest, AnAnswerThatCameBeforeItsStateNamesTheStepBefore) {
  neighbourhood_.participants = {make_entry(1)};
  reject(make_answer(13), Verdict::kEarly, 13);
  EXPECT_EQ(look(), only(kFoo + "sls/command step: expected at most 12, the last published, got "
                                "13"));
}

TEST_F(ParticipantCheckTest, AnAnswerBeforeAnyStateIsNamed) {
  neighbourhood_.participants = {make_entry(1)};
  reject(make_answer(0), Verdict::kEarly, 0);
  EXPECT_EQ(look(),
            only(kFoo + "sls/command step: expected none before a state is published, got 0"));
}

TEST_F(ParticipantCheckTest, TwoAnswersToOneStepAreNamed) {
  neighbourhood_.participants = {make_entry(1)};
  take(make_answer(12));
  reject(make_answer(12), Verdict::kContradiction, 12);
  EXPECT_EQ(look(), only(kFoo + "sls/command step 12: expected one answer, got two that differ"));
}

TEST_F(ParticipantCheckTest, AnAnswerForNoVehicleIsNamed) {
  neighbourhood_.participants = {make_entry(1)};
  check_.answers().note_empty(make_peer(1), 3);
  EXPECT_EQ(look(), only(kFoo + "sls/command vehicles at step 3: expected at least one answer, got "
                                "none"));
  EXPECT_TRUE(look(3s).empty());
}

TEST_F(ParticipantCheckTest, AnswersOfAClientUnderAnotherNameAreNamed) {
  neighbourhood_.participants = {make_entry(1)};
  take(make_answer(0));
  EXPECT_TRUE(look().empty());
  OfferedAnswer answer = make_answer(1);
  answer.client_name = "bar";
  take(answer);
  const auto expected =
      only(kFoo + "sls/command client_name: expected 'foo', as announced, got 'bar'");
  EXPECT_EQ(look(), expected);
  EXPECT_EQ(look(9s), expected);  // also while the flight is paused
  neighbourhood_.participants = {};
  EXPECT_TRUE(look(10s).empty());
}

TEST_F(ParticipantCheckTest, AClientThatIsDoneAndStillAnswersIsNamed) {
  neighbourhood_.participants = {make_entry(1)};
  neighbourhood_.participants[0].announcement.done(true);
  take(make_answer(0));
  EXPECT_TRUE(look().empty());  // it may have been sent before
  EXPECT_TRUE(look(500ms).empty());
  for (std::uint64_t step = 1; step < 25; ++step) {
    take(make_answer(step));
    const auto found = look(500ms + step * 200ms);
    if (step < 21)
      EXPECT_TRUE(found.empty()) << step;
    else
      EXPECT_EQ(found, only(kFoo + "sls/participant done: expected false, as it still answers, got "
                                   "true"));
  }
  EXPECT_TRUE(look(9s).empty());
}

TEST_F(ParticipantCheckTest, AFloodOfCopiesIsNamed) {
  neighbourhood_.participants = {make_entry(1)};
  const auto answer_steps = [&](int copies) {
    for (std::uint64_t step = 0; step < 10; ++step) {
      take(make_answer(step));
      for (int i = 0; i < copies; ++i) take(make_answer(step), Verdict::kDuplicate);
    }
  };
  for (int i = 0; i < 20; ++i) {  // of states that were sent again
    answer_steps(20);
    EXPECT_TRUE(look(i * 100ms).empty());
  }
  for (int i = 0; i <= 40; ++i) {
    answer_steps(99);
    EXPECT_EQ(
        look(2s + i * 100ms),
        i < 40 ? std::vector<std::string>()
               : only(kFoo + "sls/command: expected one answer to each state, got over 30 copies "
                             "of each"));
  }
}

TEST_F(ParticipantCheckTest, AStampInTheFutureIsNamedForATime) {
  neighbourhood_.participants = {make_entry(1), make_entry(2, "bar")};
  neighbourhood_.participants[1].announcement.run_id(0xcd);
  neighbourhood_.other_runs = {0xcd};
  neighbourhood_.stamps_ahead_s = {{make_peer(1), 5.04}, {make_peer(2), 5.04}};
  const auto expected = only(kFoo +
                             "sls/command source timestamp: expected none in the future, got "
                             "5.0 s ahead of our clock");
  EXPECT_EQ(look(), expected);
  neighbourhood_.stamps_ahead_s.clear();
  EXPECT_EQ(look(2s), expected);
  EXPECT_TRUE(look(2001ms).empty());
}

TEST_F(ParticipantCheckTest, AMistakeInAnswersOfAnUnannouncedWriterNamesItAsDiscoveryDoes) {
  neighbourhood_.command_writers[make_peer(1)] = "'foo' (10.0.0.2)";
  neighbourhood_.stamps_ahead_s = {{make_peer(1), 5.04}};
  EXPECT_EQ(look(), only("'foo' (10.0.0.2): sls/command source timestamp: expected none in the "
                         "future, got 5.0 s ahead of our clock"));
}

TEST_F(ParticipantCheckTest, AStageNameThatIsNotUtf8IsNamed) {
  neighbourhood_.participants = {make_entry(1)};
  OfferedAnswer answer = make_answer(4);
  answer.answer.stage_name = "h\xf6he";
  for (int i = 0; i < 3; ++i, ++answer.step) {
    take(answer);
    EXPECT_EQ(look(i * 2s), only(kFoo + "sls/command reference.stage_name at step 4: expected "
                                        "UTF-8, got 'h\\xf6he'"));
  }
  answer.answer.stage_name = "h\xc3\xb6he";
  take(answer);
  EXPECT_TRUE(look(7s).empty());
}

TEST_F(ParticipantCheckTest, UnknownParticipantsCannotFillTheMemory) {
  for (int i = 0; i < 100'000; ++i) {
    bus::PeerId peer;
    peer.bytes[0] = static_cast<std::uint8_t>(i);
    peer.bytes[1] = static_cast<std::uint8_t>(i >> 8);
    check_.answers().note_rejected(make_answer(999), peer, Verdict::kWrongStep, 1);
  }
  EXPECT_TRUE(look().empty());  // none of them is a participant
}

}  // namespace
}  // namespace sls::sim
