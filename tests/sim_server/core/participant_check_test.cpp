#include "sim_server/core/participants/participant_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <sstream>

#include "common/bus/topics.hpp"

namespace sls::sim {
namespace {

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

/// A ready controller "foo" of vehicles 0 and 1 with changes: "1 run=cd vehicles=7+8". Others have
/// letters as hashes: "scenario=b".
sync::Member parse_member(const std::string& text) {
  std::istringstream words(text);
  int number = 0;
  words >> number;
  sync::Member entry;
  Participant& announcement = entry.announcement;
  entry.peer = make_peer(static_cast<std::uint8_t>(number));
  entry.ready_since = sync::Time(std::chrono::seconds(number));
  announcement.run_id(kRun);
  announcement.contract_sha256(bus::kContractSha256);
  announcement.role(ParticipantRole::ROLE_CONTROLLER);
  announcement.name("foo");
  announcement.host("box");
  announcement.vehicle_ids({0, 1});
  announcement.scenario_sha256(kScenario);
  announcement.ready(true);
  std::string value;
  const auto make_hash = [&] { return value.empty() ? value : std::string(64, value[0]); };
  const std::map<std::string, std::function<void()>> changes = {
      {"name", [&] { announcement.name(value); }},
      {"role", [&] { announcement.role(static_cast<ParticipantRole>(std::stoi(value))); }},
      {"run", [&] { announcement.run_id(std::stoull(value, nullptr, 16)); }},
      {"contract", [&] { announcement.contract_sha256(make_hash()); }},
      {"scenario", [&] { announcement.scenario_sha256(make_hash()); }},
      {"library", [&] { announcement.library_sha256(make_hash()); }},
      {"unready", [&] { announcement.ready(false); }},
      {"done", [&] { announcement.done(true); }},
      {"gone", [&] { entry.is_gone = true; }},
      {"silent", [&] { entry.is_repeated = true; }},
      {"vehicles", [&] {
         announcement.vehicle_ids().clear();
         std::istringstream ids(value);
         for (std::string id; std::getline(ids, id, '+');)
           announcement.vehicle_ids().push_back(static_cast<std::uint32_t>(std::stoul(id)));
       }}};
  for (std::string word; std::getline(words, word, ' ');) {
    if (word.empty()) continue;
    const std::string key = word.substr(0, word.find('='));
    value = word.substr(std::min(word.size(), key.size() + 1));
    changes.at(key)();
  }
  return entry;
}

/// An answer to a step with changes: "5 run=cd".
OfferedAnswer parse_answer(const std::string& text) {
  std::istringstream words(text);
  OfferedAnswer answer;
  answer.run_id = kRun;
  answer.client_name = "foo";
  words >> answer.step;
  for (std::string word; words >> word;) {
    const std::string key = word.substr(0, word.find('=')), value = word.substr(key.size() + 1);
    if (key == "run") answer.run_id = std::stoull(value, nullptr, 16);
    if (key == "vehicle") answer.vehicle_id = static_cast<std::uint32_t>(std::stoul(value));
    if (key == "name") answer.client_name = value;
    if (key == "stage") answer.answer.stage_name = value;
  }
  return answer;
}

/// Plays events, separated by " | ". Participants have numbers, and answers come from the first.
///
///     members 1 run=cd, 2       their announcements (parse_member)
///     network                   packets may be lost
///     pause, resume             nobody need answer, or again
///     unmatched                 endpoints of controllers match only if the next two say so
///     writer 1, reader 1        of sls/command and sls/state; also no-writer 1
///     explained 1               another problem is reported already
///     deadline 1 TEXT           its writer offers no DEADLINE
///     server cd 7               another server's run and vehicle
///     ahead 1                   its stamps are 5.04 s ahead of our clock; on-time: nobody's are
///     take 5, copy 5, empty 5   an accepted answer, a copy, one for no vehicle
///     wrong-step 500 3          the answer 3 is rejected while step 500 is awaited, for this or
///                               another cause
///     look 4000 TEXT            all mistakes after 4 s, or none
///     due 4000                  when the next look is due
///     admits 1 library=c, 2: 1  which of them may take part
///     rejections TEXT           the rejected answers of participant 1
class CheckEventsTest : public testing::Test {
 protected:
  void play(const std::string& events) {
    for (std::size_t begin = 0, end = 0; end != std::string::npos; begin = end + 3) {
      end = events.find(" | ", begin);
      const std::string event = events.substr(begin, end - begin);
      SCOPED_TRACE(event);
      const std::string verb = event.substr(0, event.find(' '));
      play_one(verb, event.substr(std::min(event.size(), verb.size() + 1)));
    }
  }

  ParticipantCheck check_{kRun, make_scenario(), {0, 1}};

 private:
  static std::vector<sync::Member> parse_members(const std::string& text) {
    std::vector<sync::Member> members;
    std::istringstream parts(text);
    for (std::string part; std::getline(parts, part, ',');) members.push_back(parse_member(part));
    return members;
  }

  static sync::Time at(int time_ms) {
    return sync::Time(std::chrono::hours(1) + std::chrono::milliseconds(time_ms));
  }

  std::string look(int time_ms) {
    neighbourhood_.now = at(time_ms);
    for (const sync::Member& member : neighbourhood_.participants)
      if (are_matched_ && member.announcement.role() == ParticipantRole::ROLE_CONTROLLER) {
        neighbourhood_.state_readers.insert(member.peer);
        neighbourhood_.command_writers.emplace(member.peer, kWriter);
      }
    std::string texts;
    for (const auto& [key, text] : check_.look(neighbourhood_))
      texts += (texts.empty() ? "" : "; ") + text;
    return texts.empty() ? "none" : texts;
  }

  void play_one(const std::string& verb, const std::string& rest) {
    const std::string text = rest.substr(std::min(rest.size(), rest.find(' ') + 1));
    const auto peer = [&] { return make_peer(static_cast<std::uint8_t>(std::stoi(rest))); };
    const auto take = [&](Verdict verdict) {
      check_.answers().note_taken(parse_answer(rest), make_peer(1), verdict);
    };
    const std::map<std::string, std::function<void()>> events = {
        {"members", [&] { neighbourhood_.participants = parse_members(rest); }},
        {"network", [&] { neighbourhood_.is_on_network = true; }},
        {"pause", [&] { neighbourhood_.is_flying = false; }},
        {"resume", [&] { neighbourhood_.is_flying = true; }},
        {"unmatched", [&] { are_matched_ = false; }},
        {"writer", [&] { neighbourhood_.command_writers[peer()] = kWriter; }},
        {"no-writer", [&] { neighbourhood_.command_writers.erase(peer()); }},
        {"reader", [&] { neighbourhood_.state_readers.insert(peer()); }},
        {"explained", [&] { neighbourhood_.explained.insert(peer()); }},
        {"deadline", [&] { neighbourhood_.missing_deadlines[peer()] = text; }},
        {"server",
         [&] {
           neighbourhood_.other_runs.insert(std::stoull(rest, nullptr, 16));
           neighbourhood_.other_vehicles.insert(static_cast<std::uint32_t>(std::stoul(text)));
         }},
        {"ahead", [&] { neighbourhood_.stamps_ahead_s[peer()] = 5.04; }},
        {"on-time", [&] { neighbourhood_.stamps_ahead_s.clear(); }},
        {"take", [&] { take(Verdict::kAccepted); }},
        {"copy", [&] { take(Verdict::kDuplicate); }},
        {"empty", [&] { check_.answers().note_empty(make_peer(1), std::stoull(rest)); }},
        {"rejections",
         [&] { EXPECT_EQ(check_.answers().describe_rejections(make_peer(1)), rest); }},
        {"due", [&] { EXPECT_EQ(check_.next_due(), at(std::stoi(rest))); }},
        {"look", [&] { EXPECT_EQ(look(std::stoi(rest)), text); }},
        {"admits", [&] {
           std::string admitted;
           const std::size_t colon = rest.find(": ");
           for (const auto& member : check_.admit_controllers(parse_members(rest.substr(0, colon))))
             admitted += (admitted.empty() ? "" : ", ") + std::to_string(member.peer.bytes[0]);
           EXPECT_EQ(admitted, rest.substr(colon + 2));
         }}};
    const std::map<std::string, Verdict> verdicts = {{"other-run", Verdict::kOtherRun},
                                                     {"unknown-vehicle", Verdict::kUnknownVehicle},
                                                     {"wrong-step", Verdict::kWrongStep},
                                                     {"early", Verdict::kEarly},
                                                     {"contradiction", Verdict::kContradiction}};
    if (const auto verdict = verdicts.find(verb); verdict != verdicts.end())
      check_.answers().note_rejected(parse_answer(text), make_peer(1), verdict->second,
                                     std::stoull(rest));
    else
      events.at(verb)();
  }

  const std::string kWriter = "'foo' (10.0.0.2)";
  Neighbourhood neighbourhood_;
  bool are_matched_ = true;  // the endpoints of every controller
};

struct Row {
  std::string name, events;
};

class ParticipantCheckTest : public CheckEventsTest, public testing::WithParamInterface<Row> {};

const std::string kFoo = "controller 'foo' on box: ", kField = kFoo + "sls/participant ",
                  kCommand = kFoo + "sls/command ", kB(64, 'b'), kC(64, 'c');
const std::string kAhead =
    "sls/command source timestamp: expected none in the future, got 5.0 s ahead of our clock";
const std::string kDeadline = "sls/command of 'foo': DEADLINE";
const std::string kOtherRun = "run_id: expected 00000000000000ab, got 00000000000000cd";

const Row kRows[] = {
    // --- announcements
    {"OursDoNothingWrong",
     "members 1, 2 name=tape role=1 | writer 1 | look 0 none | look 1000 none | look 4000 none | "
     "look 9000 none | admits 1, 2 name=tape role=1: 1, 2"},
    {"AnotherContractIsNamedAtOnceAndNotAdmitted",
     "members 1 contract=1 vehicles=99, 2 name=tape role=1 contract= | look 0 " + kField +
         "contract_sha256: expected " + bus::kContractSha256 + ", got " + std::string(64, '1') +
         "; recorder 'tape' on box: sls/participant contract_sha256: expected " +
         bus::kContractSha256 + ", got none | admits 1 contract=1: "},
    {"AnUnknownRunIsReportedOnceItLasts",
     "members 1 run=cd | look 0 none | look 3900 none | look 4000 " + kField + kOtherRun +
         " | look 9000 " + kField + kOtherRun + " | members 1 | look 10000 none"},
    {"ARunOfZeroIsNamedOnceItLastsIfItCannotWaitForAnotherServer",
     "members 1 run=0 | look 0 none | look 4000 " + kField +
         "run_id: expected 00000000000000ab, got 0 | members 1 run=0 vehicles=7 | look 5000 none | "
         "members 1 run=0 vehicles= | look 6000 none | look 10000 " +
         kField + "run_id: expected 00000000000000ab, got 0"},
    {"AControllerOfAnotherServerIsNotOurs",
     "members 1 run=cd vehicles=7 scenario=, 2 run=0 vehicles=8 | server cd 7 | deadline 1 " +
         kDeadline + " | deadline 2 " + kDeadline + " | look 0 none | look 5000 none"},
    {"TheDeadAndTheDoneAreNotAccused",
     "members 1 run=cd silent, 2 run=cd done | other-run 5 5 run=cd | look 0 none | look 9000 "
     "none"},
    {"UnknownVehiclesAreReportedOnceTheyLast",
     "members 1 vehicles=1+7+8+20 | server cd 20 | look 0 none | look 4000 " + kField +
         "vehicle_ids: expected 0-1, got 7-8 | members 1 vehicles= | look 5000 none | look 9000 " +
         kField + "vehicle_ids: expected 0-1, got none"},
    {"AnotherScenarioIsNamedWithBoth", "members 1 scenario=b | look 0 " + kField +
                                           "scenario_sha256: expected " + kScenario + ", got " +
                                           kB},
    {"ARoleThatIsNotDefinedIsNamed",
     "members 1 role=7 | look 0 participant 'foo' on box: sls/participant role: expected "
     "controller or recorder, got 7"},
    {"ARecorderThatWritesCommandsIsNamed",
     "members 1 role=1 | look 0 none | writer 1 | look 0 recorder 'foo' on box: sls/participant "
     "role: expected controller, as it writes sls/command, got recorder"},
    {"AClientThatIsNeverReadyIsNamedWithItsEndpoints",
     "members 1 unready | look 0 none | look 3900 none | look 4000 " + kField +
         "ready: expected true, as its endpoints are matched, got false | members 1 | "
         "look 5000 none"},
    {"AMissingEndpointIsNamed",
     "unmatched | members 1 | look 0 none | look 4000 " + kFoo +
         "expected a reader of sls/state and a writer of sls/command, got none | writer 1 | "
         "look 5000 none | look 9000 " +
         kFoo +
         "expected a reader of sls/state, got none | no-writer 1 | reader 1 | "
         "look 10000 none | look 14000 " +
         kFoo + "expected a writer of sls/command, got none | explained 1 | look 15000 none"},
    {"EndpointsAreWaitedForLongerOnANetwork",
     "unmatched | network | members 1 | look 0 none | look 14900 none | look 15000 " + kFoo +
         "expected a reader of sls/state and a writer of sls/command, got none"},
    {"ANameThatIsNotUtf8IsNamed",
     "members 1 name=f\xfc\xfc, 2 name=f\xc3\xbc | look 0 controller 'f\\xfc\\xfc' on box: "
     "sls/participant name: expected UTF-8, got 'f\\xfc\\xfc'"},
    {"NamesAreShownPrintable",
     "members 1 name=evil\n\x1b[2J run=0 | look 0 none | look 4000 controller 'evil\\x0a\\x1b[2J' "
     "on box: sls/participant run_id: expected 00000000000000ab, got 0"},

    // --- strangers
    {"AWriterOfCommandsWithoutAnAnnouncementIsNamedOnceThatLasts",
     "writer 1 | look 0 none | due 4000 | look 3900 none | look 4000 'foo' (10.0.0.2): writes "
     "sls/command: expected an announcement in sls/participant, got none | explained 1 | "
     "look 5000 none"},
    {"AnAnnouncementIsWaitedForLongerOnANetwork",
     "writer 1 | network | look 0 none | look 14900 none | look 15000 'foo' (10.0.0.2): writes "
     "sls/command: expected an announcement in sls/participant, got none | members 1 | "
     "look 16000 none"},
    {"AMissingDeadlineExplainsThatNoWriterMatches", "members 1 | deadline 1 " + kDeadline +
                                                        " | look 0 " + kDeadline + " | look 2000 " +
                                                        kDeadline},
    {"AMissingDeadlineIsReportedOnlyOfOurControllers",
     "deadline 1 " + kDeadline + " | look 0 none | look 4000 " + kDeadline +
         " | members 1 | "
         "look 5000 " +
         kDeadline + " | members 1 run=cd | look 6000 none | look 10000 " + kDeadline + "; " +
         kField + kOtherRun},

    // --- libraries
    {"AnotherLibraryThanThatOfTheFirstIsRefused",
     "members 2 name=second, 1 name=first library=c | "
     "admits 2 name=second, 1 name=first library=c: 1 | look 0 controller 'second' on box: "
     "sls/participant library_sha256: expected " +
         kC +
         " (that of 'first'), got none; it is "
         "refused | admits 2: 2 | admits 2, 3 library=c: 2"},
    {"ALibraryIsRefusedOnlyWhileAnotherOneBindsIt",
     "members 2 | admits 1 library=c, 2: 1 | admits 2: 2 | look 0 none"},
    {"ALibraryBindsTheOthersOfItsVehicleIfItsClientCanFly",
     "admits 1 library=c vehicles=0, 2: 1 | admits 1 library=c vehicles=0, 2 vehicles=1: 1, 2 | "
     "admits 1 library=c vehicles=0 unready, 2 vehicles=0: 2 | "
     "admits 1 library=c vehicles=0 scenario=b, 2 vehicles=0: 2"},
    {"TheLibraryOfAClientThatIsGoneBindsNobody",
     "members 1 library=c gone, 2 library=d | admits 1 library=c gone, 2 library=d: 2 | "
     "look 0 none"},
    {"TheLibraryThatHasFlownStaysInForceWhenItsClientIsGone",
     "admits 1 library=c: 1 | take 0 | admits 4 library=d:  | admits 3 library=c, 4 library=d: 3"},

    // --- answers
    {"AnswersThatAreAllRejectedAreNamedWithCauseAndCount",
     "members 1 | other-run 5 5 run=cd | other-run 5 5 run=cd | other-run 5 5 run=cd | "
     "rejections  (3 of its answers rejected, none taken: " +
         kOtherRun +
         ") | look 0 none | "
         "look 4000 " +
         kFoo + "sls/command: 3 answers rejected, none taken: " + kOtherRun +
         " | take 5 | look 4100 none | rejections "},
    {"CausesOfRejection",
     "members 1 | look 0 none | unknown-vehicle 5 5 vehicle=9 | rejections  (1 of its answers "
     "rejected, none taken: vehicle_id: expected 0-1, got 9) | wrong-step 500 3 | rejections  (2 "
     "of its answers rejected, none taken: step: expected 500, got 3)"},
    {"APauseIsNoTimeWithoutAnswersThatAreTaken",
     "members 1 | other-run 5 5 run=cd | look 0 none | pause | look 5000 none | look 9000 none | "
     "resume | look 12900 none | look 13000 " +
         kFoo + "sls/command: 1 answers rejected, none taken: " + kOtherRun},
    {"AFewAnswersToOldStepsAreNoMistake",
     "members 1 | wrong-step 500 3 | wrong-step 500 4 | look 0 none | look 5000 none | "
     "wrong-step 500 5 | look 6000 " +
         kFoo + "sls/command: 3 answers rejected, none taken: step: expected 500, got 5"},
    {"AnAnswerOfAnotherRunIsNotEarly", "members 1 | other-run 5 9 run=cd | look 0 none"},
    {"AnOldAnswerAfterAnotherMistakeIsOneMore",
     "members 1 | other-run 5 5 run=cd | wrong-step 500 3 | look 0 none | look 4000 " + kFoo +
         "sls/command: 2 answers rejected, none taken: step: expected 500, got 3"},
    {"AnswersToStepsThatAreNotPublishedAreNamedAtOnceAndForATime",
     "members 1 | wrong-step 12 13 | look 0 " + kCommand +
         "step: expected at most 12, the last published, got 13 | look 2000 " + kCommand +
         "step: expected at most 12, the last published, got 13 | look 2001 none"},
    {"AnAnswerThatCameBeforeItsStateNamesTheStepBefore",
     "members 1 | early 13 13 | look 0 " + kCommand +
         "step: expected at most 12, the last published, got 13"},
    {"AnAnswerBeforeAnyStateIsNamed", "members 1 | early 0 0 | look 0 " + kCommand +
                                          "step: expected none before a state is published, got 0"},
    {"TwoAnswersToOneStepAreNamed", "members 1 | take 12 | contradiction 12 12 | look 0 " +
                                        kCommand +
                                        "step 12: expected one answer, got two that differ"},
    {"AnAnswerForNoVehicleIsNamed",
     "members 1 | empty 3 | look 0 " + kCommand +
         "vehicles at step 3: expected at least one answer, got none | look 3000 none"},
    {"AnswersOfAClientUnderAnotherNameAreNamed",
     "members 1 | take 0 | look 0 none | take 1 name=bar | look 0 " + kCommand +
         "client_name: expected 'foo', as announced, got 'bar' | look 9000 " + kCommand +
         "client_name: expected 'foo', as announced, got 'bar' | members | look 10000 none"},
    {"AStampInTheFutureIsNamedForATime",
     "members 1, 2 run=cd | server cd 7 | ahead 1 | ahead 2 | look 0 " + kFoo + kAhead +
         " | on-time | look 2000 " + kFoo + kAhead + " | look 2001 none"},
    {"AMistakeInAnswersOfAnUnannouncedWriterNamesItAsDiscoveryDoes",
     "writer 1 | ahead 1 | look 0 'foo' (10.0.0.2): " + kAhead},
    {"AStageNameThatIsNotUtf8IsNamed",
     "members 1 | take 4 stage=h\xf6he | look 0 " + kCommand +
         "reference.stage_name at step 4: "
         "expected UTF-8, got 'h\\xf6he' | take 5 stage=h\xf6he | look 2000 " +
         kCommand +
         "reference.stage_name at step 4: expected UTF-8, got 'h\\xf6he' | take 6 stage=h\xf6he | "
         "look 4000 " +
         kCommand +
         "reference.stage_name at step 4: expected UTF-8, got 'h\\xf6he' | "
         "take 7 stage=h\xc3\xb6he | look 7000 none"},
};

TEST_P(ParticipantCheckTest, FindsTheMistakesOfTheTable) { play(GetParam().events); }

INSTANTIATE_TEST_SUITE_P(Rows, ParticipantCheckTest, testing::ValuesIn(kRows),
                         [](const auto& row) { return row.param.name; });

using ParticipantSeriesTest = CheckEventsTest;

TEST_F(ParticipantSeriesTest, AClientThatIsDoneAndStillAnswersIsNamed) {
  play("members 1 done | take 0 | look 0 none | look 500 none");
  for (int step = 1; step < 25; ++step)
    play("take " + std::to_string(step) + " | look " + std::to_string(500 + step * 200) +
         (step < 21 ? " none"
                    : " " + kField + "done: expected false, as it still answers, got true"));
  play("look 9000 none");
}

TEST_F(ParticipantSeriesTest, AFloodOfCopiesIsNamed) {
  play("members 1");
  const auto answer_steps = [&](int copies, int time_ms, const std::string& expected) {
    for (int step = 0; step < 10; ++step) {
      play("take " + std::to_string(step));
      for (int i = 0; i < copies; ++i) play("copy " + std::to_string(step));
    }
    play("look " + std::to_string(time_ms) + " " + expected);
  };
  for (int i = 0; i < 20; ++i) answer_steps(30, i * 100, "none");  // of states that were sent again
  for (int i = 0; i <= 40; ++i)
    answer_steps(31, 2000 + i * 100,
                 i < 40 ? "none"
                        : kFoo +
                              "sls/command: expected one answer to each state, got over 30 "
                              "copies of each");
}

TEST_F(ParticipantSeriesTest, UnknownParticipantsCannotFillTheMemory) {
  for (int i = 0; i < 100'000; ++i) {
    bus::PeerId peer;
    peer.bytes[0] = static_cast<std::uint8_t>(i);
    peer.bytes[1] = static_cast<std::uint8_t>(i >> 8);
    check_.answers().note_rejected(parse_answer("999"), peer, Verdict::kWrongStep, 1);
  }
  play("look 0 none");  // none of them is a participant
}

TEST(AdmissionTest, RecordersWithAnotherContractAreNotAdmitted) {
  EXPECT_TRUE(ParticipantCheck::admit_recorders({parse_member("1 role=1 contract=")}).empty());
}

}  // namespace
}  // namespace sls::sim
