// The acceptance rules of design 6 ("Commands", "Standby"), tested through the interface of the
// gate.
#include "sim_server/core/command_gate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <sstream>

namespace sls::sim {

bool operator==(const OfferedAnswer& a, const OfferedAnswer& b) {
  return a.run_id == b.run_id && a.step == b.step && a.client_name == b.client_name &&
         a.answer.f_Q_W == b.answer.f_Q_W && a.answer.error_code == b.answer.error_code;
}

namespace {

using model::ErrorCode;
using model::MissionPhase;

constexpr std::uint64_t kRun = 0xfeed;
constexpr std::uint32_t kVehicle = 3;
constexpr double kForceLimit = 50.0;

bus::PeerId make_peer(std::uint8_t number) {
  bus::PeerId peer;
  peer.bytes.fill(number);
  return peer;
}

const bus::PeerId kStranger = make_peer(7);
const ReadyClient kStrong = {make_peer(9), "strong", 10};
const ReadyClient kWeak = {make_peer(5), "weak", 1};
const ReadyClient kWeakest = {make_peer(4), "weakest", 0};

OfferedAnswer make_answer(std::uint64_t step, double force_z = -10.0) {
  OfferedAnswer command;
  command.run_id = kRun;
  command.vehicle_id = kVehicle;
  command.step = step;
  command.answer.f_Q_W = {0.01 * static_cast<double>(step % 1000), 1.0, force_z};
  command.client_name = "named by nobody";
  return command;
}

/// Counters that are not zero, such as "superseded 2, rejected_step 1".
std::string to_string(const SyncCounters& counters) {
  std::string text;
  const auto add = [&](const char* name, std::uint64_t count) {
    if (count > 0) text += (text.empty() ? "" : ", ") + (name + (" " + std::to_string(count)));
  };
  add("late", counters.late());
  add("duplicate", counters.duplicate());
  add("superseded", counters.superseded());
  add("take_overs", counters.take_overs());
  add("rejected_not_finite", counters.rejected_not_finite());
  add("rejected_force_limit", counters.rejected_force_limit());
  add("rejected_run", counters.rejected_run());
  add("rejected_step", counters.rejected_step());
  add("rejected_vehicle", counters.rejected_vehicle());
  add("rejected_client", counters.rejected_client());
  add("rejected_fault", counters.rejected_fault());
  return text;
}

/// Number of answers that were not taken. Exactly one counter counts each.
std::uint64_t sum_unapplied(const SyncCounters& counters) {
  return counters.late() + counters.duplicate() + counters.superseded() +
         counters.rejected_not_finite() + counters.rejected_force_limit() +
         counters.rejected_run() + counters.rejected_step() + counters.rejected_vehicle() +
         counters.rejected_client() + counters.rejected_fault();
}

// --- events --------------------------------------------------------------------------------------

const std::map<std::string, Verdict> kVerdicts = {
    {"accepted", Verdict::kAccepted},
    {"held", Verdict::kHeld},
    {"duplicate", Verdict::kDuplicate},
    {"superseded", Verdict::kSuperseded},
    {"late", Verdict::kLate},
    {"not finite", Verdict::kNotFinite},
    {"force limit", Verdict::kForceLimit},
    {"other run", Verdict::kOtherRun},
    {"early", Verdict::kEarly},
    {"wrong step", Verdict::kWrongStep},
    {"contradiction", Verdict::kContradiction},
    {"unknown vehicle", Verdict::kUnknownVehicle},
    {"unknown client", Verdict::kUnknownClient},
    {"undefined", Verdict::kUndefined},
    {"error code", Verdict::kErrorCode},
    {"unknown stage", Verdict::kUnknownStage},
    {"early end", Verdict::kEarlyEnd},
};

/// An answer to a step with changes: "12 z=-3 free_fall" is one with another force and an error.
OfferedAnswer parse_answer(const std::string& text) {
  std::istringstream words(text);
  std::uint64_t step = 0;
  words >> step;
  OfferedAnswer offered = make_answer(step);
  model::Answer& answer = offered.answer;
  model::Reference& reference = answer.reference;
  Eigen::Vector3d numbers = Eigen::Vector3d::Zero();
  const std::map<std::string, Eigen::Vector3d*> vectors = {
      {"f", &answer.f_Q_W},
      {"numbers", &numbers},
      {"position", &reference.position},
      {"velocity", &reference.velocity},
      {"acceleration", &reference.acceleration},
      {"jerk", &reference.jerk},
      {"snap", &reference.snap}};
  double value = 0.0;
  const auto fail_with = [&](ErrorCode code) {
    answer.error_code = code;
    answer.mission = MissionPhase::kFailed;
  };
  const std::map<std::string, std::function<void()>> others = {
      {"run", [&] { offered.run_id += static_cast<std::uint64_t>(value); }},
      {"vehicle", [&] { offered.vehicle_id += static_cast<std::uint32_t>(value); }},
      {"early", [&] { offered.is_early = true; }},
      {"compute_ns", [&] { answer.compute_time = std::chrono::nanoseconds(int(value)); }},
      {"stage", [&] { answer.memory.stage = static_cast<std::uint32_t>(value); }},
      {"mission", [&] { answer.mission = MissionPhase(static_cast<std::uint32_t>(value)); }},
      {"free_fall", [&] { fail_with(ErrorCode::kFreeFall); }},
      {"rod_level", [&] { fail_with(ErrorCode::kRodLevel); }},
      {"fault", [&] { answer.error_code = ErrorCode(static_cast<std::uint32_t>(value)); }}};
  for (std::string word; words >> word;) {
    const std::string key = word.substr(0, word.find('='));
    value = word == key ? 0.0 : std::stod(word.substr(key.size() + 1));
    if (const auto other = others.find(key); other != others.end())
      other->second();
    else  // "jerk_z" is a number of the reference
      (*vectors.at(key.substr(0, key.find('_'))))[key.back() - 'x'] = value;
  }
  if (text.find("numbers") != std::string::npos) answer.memory.numbers = numbers;
  return offered;
}

/// Plays events, separated by " | ", to a gate whose only client, "strong", is asked for step 0:
///
///     ready strong weak!   the clients; "!": gone
///     expect 5             the step that is awaited now
///     skip 100             steps that nobody answers
///     fly 100 NAME         the client has its answers accepted, to the next 100 steps
///     NAME ANSWER: VERDICT an answer (parse_answer), and what the gate says to it
///     silent: yes          the awaited client is passed over
///     miss: 2              its misses in a row
///     mission 600          another gate, whose mission of two stages ends at step 500 at the
///                          earliest, is asked for that step
///
/// The others are what the gate must then say. Words in parentheses explain.
class GateEventsTest : public testing::Test {
 protected:
  GateEventsTest() { restart({kForceLimit}, 0); }

  void play(const std::string& events) {
    for (std::size_t begin = 0, end = 0; end != std::string::npos; begin = end + 3) {
      end = events.find(" | ", begin);
      const std::string event = events.substr(begin, end - begin);
      SCOPED_TRACE(event);
      play_one(event.substr(0, event.find(" (")));
    }
  }

  CommandGate& gate() { return *gate_; }

 private:
  void restart(const AnswerLimits& limits, std::uint64_t step) {
    gate_.emplace(kRun, kVehicle, limits);
    gate_->set_clients({kStrong});
    gate_->expect(step_ = step);
  }

  static ReadyClient find(std::string name) {
    const bool is_gone = name.back() == '!';
    if (is_gone) name.pop_back();
    const std::map<std::string, ReadyClient> clients = {
        {"strong", kStrong},
        {"weak", kWeak},
        {"weakest", kWeakest},
        {"stranger", {kStranger, "stranger", 0}},
        {"restarted", {make_peer(88), "strong", 10}},  // a new process is a new participant
        {"alpha", {make_peer(200), "alpha", 5}},
        {"beta", {make_peer(1), "beta", 5}},
        {"twin1", {make_peer(1), "twin", 5}},
        {"twin2", {make_peer(2), "twin", 5}},
        {"least", {make_peer(1), "a", std::numeric_limits<std::int32_t>::min()}},
        {"greatest", {make_peer(2), "b", std::numeric_limits<std::int32_t>::max()}}};
    ReadyClient client = clients.at(name);
    client.is_gone = is_gone;
    return client;
  }

  void play_one(const std::string& event) {
    std::istringstream words(event);
    std::string verb;
    words >> verb;
    const std::string rest = event.substr(std::min(event.size(), verb.size() + 1));
    if (verb == "ready") {
      std::vector<ReadyClient> clients;
      for (std::string name; words >> name;) clients.push_back(find(name));
      gate_->set_clients(clients);
    } else if (verb == "expect") {
      gate_->expect(step_ = std::stoull(rest));
    } else if (verb == "mission") {
      restart({kForceLimit, 2, 500}, std::stoull(rest));
    } else if (verb == "skip") {
      for (int i = 0; i < std::stoi(rest); ++i) gate_->expect(++step_);
    } else if (verb == "fly") {
      const ReadyClient flyer = find(rest.substr(rest.find(' ') + 1));
      for (int i = 0; i < std::stoi(rest); ++i) {
        ASSERT_EQ(gate_->offer(make_answer(step_), flyer.peer), Verdict::kAccepted) << step_;
        gate_->expect(++step_);
      }
    } else if (verb == "silent:") {
      EXPECT_EQ(gate_->pass_over_silent_client(), rest == "yes");
    } else if (verb == "miss:") {
      EXPECT_EQ(gate_->count_miss(), std::stoi(rest));
    } else if (verb == "awaits") {
      const auto awaited = gate_->awaited_client();
      EXPECT_EQ(awaited ? awaited->name + (awaited->is_gone ? "!" : "") : "nobody", rest);
    } else if (verb == "applies") {
      expect_answer(gate_->accepted(), rest);
    } else if (verb == "refused") {
      expect_answer(gate_->refused(), rest);
    } else if (verb == "refusal") {
      EXPECT_EQ(gate_->refusal().value_or("none"), rest);
    } else if (verb == "refusals") {
      EXPECT_EQ(gate_->describe_refusals(), rest);
    } else if (verb == "take-over") {
      const auto& change = gate_->take_over();
      EXPECT_EQ(change ? change->from + " " + change->to : "none", rest);
    } else if (verb == "answers") {
      std::map<bus::PeerId, std::string> known;
      gate_->for_each_client([&](const bus::PeerId& peer, std::uint64_t answers, bool is_missing) {
        known[peer] = std::to_string(answers) + (is_missing ? " missing" : "");
      });
      const std::size_t space = rest.find(' ');
      EXPECT_EQ(known[find(rest.substr(0, space)).peer], rest.substr(space + 1));
    } else {
      const std::size_t colon = rest.find(": ");
      const OfferedAnswer offered = parse_answer(rest.substr(0, colon));
      EXPECT_EQ(gate_->offer(offered, find(verb).peer), kVerdicts.at(rest.substr(colon + 2)));
    }
  }

  static void expect_answer(const std::optional<OfferedAnswer>& answer, const std::string& text) {
    ASSERT_EQ(answer.has_value(), text != "none");
    EXPECT_EQ(answer, answer ? std::optional(parse_answer(text)) : std::nullopt);
  }

  std::optional<CommandGate> gate_;
  std::uint64_t step_ = 0;
};

struct Row {
  const char* name;
  const char* events;
  const char* counters;  // in the end
};

class CommandGateTest : public GateEventsTest, public testing::WithParamInterface<Row> {};

// --- table ---------------------------------------------------------------------------------------

const Row kRows[] = {
    {"TheAwaitedAnswerOfAReadyClientIsAccepted",
     "strong 0: accepted | applies 0 | refusal none | refused none", ""},
    {"AnAnswerToAStateThatWasNotPublishedYetIsRefused",
     "expect 4 | expect 5 | strong 5 early: early | applies none | refusal none | "
     "strong 4 early: late (it arrives before the next state) | strong 5: accepted",
     "rejected_step 1"},
    {"TheRefusedAnswerToTheAwaitedStepIsKept",
     "refused none | strong 0 free_fall: error code | refused 0 free_fall | applies none | "
     "expect 1 | refused none",
     "rejected_fault 1"},
    {"ExpectingTheNextStepForgetsTheAcceptedAnswer",
     "strong 0: accepted | expect 1 | applies none | strong 1: accepted | applies 1", ""},
    {"AForceAtTheLimitIsAcceptedAndJustBeyondRefused",
     "strong 0 f_x=0 f_y=0 f_z=-50.000000000000007: force limit | applies none | "
     "ready | ready weak | weak 0 f_x=30 f_y=0 f_z=-40: accepted",
     "rejected_force_limit 1"},
    {"AForceWhoseSquaresOverflowIsBeyondTheLimit",
     "strong 0 f_x=1e300 f_y=-1e300 f_z=1e300: force limit | applies none",
     "rejected_force_limit 1"},
    {"TheLargestNumbersOfAReferenceAreFinite",
     "strong 0 snap_x=1.7976931348623157e308 snap_y=1.7976931348623157e308 "
     "jerk_x=-1.7976931348623157e308 jerk_y=-1.7976931348623157e308: accepted",
     ""},
    {"AFaultIsNamedRatherThanItsReference", "strong 0 free_fall jerk_x=nan: error code",
     "rejected_fault 1"},
    {"ACommandOfAnotherRunIsRefusedAndNotCountedAgainstTheClient",
     "strong 0 run=1: other run | applies none | refusal none", "rejected_run 1"},
    {"ACommandForAnUnknownVehicleIsRefusedAndNotCountedAgainstTheClient",
     "strong 0 vehicle=1: unknown vehicle | applies none | refusal none", "rejected_vehicle 1"},
    {"AStepThatIsNotAwaitedIsRefusedAndNotCountedAgainstTheClient",
     "strong 1: wrong step | strong 1000000: wrong step | "
     "strong 18446744073709551615: wrong step | applies none | refusal none",
     "rejected_step 3"},
    {"AnAnswerOfAnUnannouncedClientIsRefused",
     "stranger 0: unknown client | applies none | strong 0: accepted", "rejected_client 1"},
    {"NothingThatAnUnannouncedSenderSendsEndsTheFlight",
     "stranger 0 f_x=nan: not finite | refusal none | stranger 0 f_x=1e6: force limit | "
     "refusal none | stranger 0 free_fall: error code | refusal none | "
     "stranger 0: unknown client | refusal none | stranger 77: wrong step | refusal none | "
     "applies none | strong 0: accepted",
     "rejected_not_finite 1, rejected_force_limit 1, rejected_step 1, rejected_client 1, "
     "rejected_fault 1"},
    {"ACopyOfAnAcceptedCommandIsCountedDuplicate",
     "strong 0: accepted | strong 0 compute_ns=12345: duplicate (the time is not compared) | "
     "expect 1 | strong 0: duplicate | strong 1: accepted | strong 0: duplicate",
     "duplicate 3"},
    {"AnotherAnswerToAnAnsweredStepIsNoCopy",
     "strong 0: accepted | strong 0 f_z=-11: contradiction | expect 1 | "
     "strong 0 f_z=-11: contradiction",
     "rejected_step 2"},
    {"AnotherClientsCopyOfAnAcceptedCommandIsNoDuplicate",
     "strong 0: accepted | stranger 0: unknown client | expect 1 | stranger 0: wrong step",
     "rejected_step 1, rejected_client 1"},
    {"ACopyFromFarBackIsCountedAndMemoryStaysBounded",
     "fly 10000 strong | strong 9998: duplicate | strong 0: wrong step (forgotten)",
     "duplicate 1, rejected_step 1"},

    // --- refusals
    {"ARefusalOfTheOnlyClientNamesCauseClientAndStep",
     "expect 41 | strong 41 f_y=nan: not finite | "
     "refusal controller 'strong' answered step 41 with a number that is not finite",
     "rejected_not_finite 1"},
    {"AnExcessiveForceIsNamedWithItsLimit",
     "strong 0 f_x=0 f_y=300 f_z=-400: force limit | refusal controller 'strong' answered step 0 "
     "with a force beyond controller.force_limit_n: 500 N > 50 N",
     "rejected_force_limit 1"},
    {"AFaultOfTheOnlyClientIsNamed",
     "expect 2 | strong 2 fault=1 mission=2: error code | "
     "refusal controller 'strong' answered step 2 with a fault: free_fall | "
     "expect 3 | strong 3 fault=2 mission=2: error code | "
     "refusal controller 'strong' answered step 3 with a fault: rod_level | "
     "expect 4 | strong 4 fault=3 mission=2: error code | "
     "refusal controller 'strong' answered step 4 with a fault: not_finite | "
     "expect 5 | strong 5 fault=4 mission=2: error code | "
     "refusal controller 'strong' answered step 5 with a fault: stage_timeout",
     "rejected_fault 4"},
    {"AFailedMissionWithoutAFaultIsRefusedToo",
     "strong 0 mission=2: error code | applies none | "
     "refusal controller 'strong' answered step 0 with a fault: mission failed",
     "rejected_fault 1"},
    {"AStageBeyondTheMissionIsRefused",
     "mission 600 | strong 600 stage=4000000000: unknown stage | refusal controller 'strong' "
     "answered step 600 with a stage beyond its mission: stage_index 4000000000 > 2 | "
     "expect 601 | strong 601 stage=3 mission=1: unknown stage | "
     "expect 602 | strong 602 stage=2 mission=1: accepted | "
     "expect 603 | strong 603 stage=2: accepted (reported by ParticipantCheck)",
     "rejected_fault 2"},
    {"AStageMayBeAsIfTheFirstOneWereOver", "mission 0 | strong 0 stage=1: accepted", ""},
    {"AnEndBeforeTheEarliestStepIsRefused",
     "mission 499 | strong 499 stage=1 mission=1: early end | refusal controller 'strong' answered "
     "step 499 with an early end of its mission: expected at step 500 or later | "
     "strong 499 stage=2: early end (the next client would finish) | "
     "expect 500 | strong 500 stage=1 mission=1: accepted",
     "rejected_fault 2"},
    {"AnEndAfterTheLastStageAtTheEarliestStepIsAccepted",
     "mission 500 | strong 500 stage=2 mission=1: accepted", ""},
    {"ValuesThatTheContractDoesNotDefineAreRefused",
     "expect 1 | strong 1 mission=7: undefined | "
     "refusal controller 'strong' answered step 1 with an undefined value: mission 7 | "
     "expect 2 | strong 2 mission=2 fault=5: undefined | "
     "refusal controller 'strong' answered step 2 with an undefined value: fault 5 | "
     "strong 2 mission=4294967295: undefined",
     "rejected_fault 3"},
    {"AFaultInAnswerToAnotherStepEndsNothing",
     "strong 1 free_fall: error code | refusal none | strong 0: accepted", "rejected_fault 1"},
    {"ARefusalDoesNotOutliveItsStep",
     "ready strong weak | strong 0 rod_level: error code | weak 0: accepted | expect 1 | "
     "strong 1: accepted",
     "take_overs 1, rejected_fault 1"},
    {"NoRefusalWhileAnotherReadyClientCanAnswer",
     "ready strong weak | strong 0 rod_level: error code | refusal none | awaits weak | "
     "weak 0 free_fall: error code | refusal controller 'strong' answered step 0 with a fault: "
     "rod_level; controller 'weak' answered step 0 with a fault: free_fall",
     "rejected_fault 2"},
    {"ARefusalIsKnownWhileASilentStandbyIsAwaited",
     "ready strong weak | strong 0 f_x=0 f_y=0 f_z=-60: force limit | refusals controller 'strong' "
     "answered step 0 with a force beyond controller.force_limit_n: 60 N > 50 N | expect 1 | "
     "refusals controller 'strong' answered step 0 with a force beyond controller.force_limit_n: "
     "60 N > 50 N | awaits strong (its answer to this step may be valid) | "
     "strong 1: accepted | refusals ",
     "rejected_force_limit 1"},
    {"ALateAnswerThatIsRefusedIsKnownUntilItsClientGivesAValidOne",
     "expect 1 | strong 0 rod_level: error code | refusals controller 'strong' answered step 0 "
     "with a fault: rod_level | refusal none | expect 2 | strong 1: late | refusals ",
     "rejected_fault 1"},
    {"TheRefusedClientsStandbyLeavingEndsTheWait",
     "ready strong weak | strong 0 rod_level: error code | refusal none | ready strong | "
     "refusal controller 'strong' answered step 0 with a fault: rod_level",
     "rejected_fault 1"},
    {"TheAnswerAStandbyHasGivenIsTakenWhenTheStrongerOneIsRefused",
     "ready strong weak | weak 0: held | applies none | strong 0 free_fall: error code | "
     "applies 0 | refusal none",
     "rejected_fault 1"},
    {"AfterARefusedAnswerToAStepTheClientIsNotAwaitedThere",
     "ready strong weak | strong 0 free_fall: error code | refusals controller 'strong' answered "
     "step 0 with a fault: free_fall | strong 0 rod_level: error code | refusals controller "
     "'strong' answered step 0 with a fault: free_fall | strong 0: held (also before a valid one) "
     "| awaits weak | weak 0: accepted | ready strong weak! | refusal none | expect 1 | "
     "strong 0 free_fall: error code | refusals  (the step before had its answer, too)",
     "superseded 1, rejected_fault 3"},
    {"ABadCommandAfterAClientsValidAnswerIsOnlyCounted",
     "ready strong weak | weak 0: held | weak 0 free_fall: error code | "
     "strong 0 free_fall: error code | applies 0 | refusal none",
     "rejected_fault 2"},

    // --- several clients
    {"TheStrongestClientFliesAlsoWhenAnotherAnswersFirst",
     "ready weakest strong weak | weakest 0 f_z=-1: held | weak 0 f_z=-2: held | "
     "strong 0 f_z=-3: accepted | applies 0 f_z=-3",
     "superseded 2"},
    {"AWeakerClientsLateAnswerIsSuperseded",
     "ready strong weak | strong 0: accepted | weak 0: superseded | expect 1 | weak 0: superseded",
     "superseded 2"},
    {"CopiesOfAHeldAnswerAreCounted",
     "ready strong weak | weak 0: held | weak 0: duplicate | weak 0: duplicate | "
     "weak 0: duplicate | strong 0: accepted",
     "duplicate 3, superseded 1"},
    {"EqualStrengthsAreOrderedByNameNotByArrival",
     "ready | ready alpha beta | awaits alpha | beta 0 f_z=-2: held | alpha 0 f_z=-1: accepted | "
     "ready | ready beta alpha | expect 1 | awaits alpha | beta 1 f_z=-2: held | "
     "alpha 1 f_z=-1: accepted",
     "superseded 2"},
    {"EqualStrengthsAndNamesAreOrderedByPeer",
     "ready | ready twin1 twin2 | twin2 0: held | twin1 0: accepted | "
     "ready | ready twin2 twin1 | expect 1 | twin2 1: held | twin1 1: accepted",
     "superseded 2"},
    {"StrengthDecidesOverTheWholeRangeOfItsType", "ready | ready least greatest | awaits b", ""},
    {"TheStandbysHeldAnswerFliesWhenTheStrongestIsSilent",
     "ready strong weak | weak 0 f_z=-2: held | silent: yes | applies 0 f_z=-2", "take_overs 1"},
    {"TheNextClientIsAwaitedWhenTheStrongestIsSilent",
     "ready | ready strong weak weakest | silent: yes | awaits weak | applies none | silent: yes | "
     "awaits weakest | take-over none | weakest 0: accepted | take-over strong weakest",
     "take_overs 1"},
    {"WithoutAnotherClientThereIsNoTakeOver",
     "silent: no | take-over none | awaits strong | refusal none", ""},
    {"ARefusedClientDoesNotTakeOver",
     "ready strong weak | weak 0 free_fall: error code | silent: no | awaits strong",
     "rejected_fault 1"},
    {"NothingIsPassedOverOnceAnAnswerIsAccepted",
     "ready strong weak | strong 0: accepted | silent: no", ""},
    {"TheSilentClientIsSkippedUntilItAnswersAnAwaitedStep",
     "ready | ready strong weak | silent: yes | weak 0: accepted | expect 1 | "
     "awaits weak (no second wait for the silent one) | strong 0: superseded | "
     "awaits weak (step 0 is not awaited any more) | strong 1: accepted | take-over weak strong | "
     "expect 2 | awaits strong | take-over none",
     "superseded 1, take_overs 2"},
    {"TheStrongestIsAwaitedAgainAlsoIfItsAnswerCameSecond",
     "ready | ready strong weak | silent: yes | weak 0: accepted | strong 0: superseded | "
     "expect 1 | awaits strong",
     "superseded 1, take_overs 1"},
    {"TheFirstAnswerToAStepThatWentByIsLateAndTheOthersAreNot",
     "ready strong weak | expect 1 | expect 2 | strong 0: late | strong 0: duplicate | "
     "weak 0: superseded | stranger 1: wrong step | weak 1: late | applies none",
     "duplicate 1, superseded 1, rejected_step 1"},
    {"MissesAreCountedInARowAndForgottenWithAnAnswer",
     "miss: 1 | expect 1 | miss: 2 | expect 2 | strong 2: accepted | expect 3 | miss: 1 | ready | "
     "miss: 0 (nobody is awaited)",
     ""},
    {"WhenAllAreSilentTheStrongestMayComeBack",
     "ready | ready strong weak weakest | silent: yes | silent: yes | silent: no | "
     "strong 0: accepted",
     ""},
    {"WhenAllAreSilentTheNextMayComeBack",
     "ready | ready strong weak weakest | silent: yes | silent: yes | silent: no | "
     "weak 0: accepted",
     "take_overs 1"},
    {"WhenAllAreSilentTheWeakestMayComeBack",
     "ready | ready strong weak weakest | silent: yes | silent: yes | silent: no | "
     "weakest 0: accepted",
     "take_overs 1"},
    {"AStrongerClientThatJoinsFliesAfterItsFirstAnswer",
     "ready | ready weak | weak 0: accepted | expect 1 | ready weak strong | "
     "weak 1: accepted (the other may not see step 1) | strong 1: superseded | expect 2 | "
     "weak 2: held | strong 2: accepted",
     "superseded 2, take_overs 1"},
    {"ADistantClientThatJoinsMayAnswerAnEarlierStepFirst",
     "ready weak | weak 0: accepted | expect 1 | weak 1: accepted | expect 2 | ready weak strong | "
     "strong 1: superseded | awaits strong",
     "superseded 1"},
    {"AClientThatJoinsAloneIsAwaitedAtOnce",
     "strong 0: accepted | expect 1 | ready | ready weak | awaits weak | weak 1: accepted",
     "take_overs 1"},
    {"AHeldAnswerFliesWhenTheStrongerClientLeaves",
     "ready strong weak | weak 0 f_z=-2: held | ready weak | applies 0 f_z=-2", ""},
    {"AnswersOfAClientThatLeftAreCounted",
     "ready strong weak | weak 0: held | ready strong | strong 0: accepted", "superseded 1"},
    {"SilenceOutlivesANewRosterAndARestartedClientBeginsAfresh",
     "ready | ready strong weak | silent: yes | ready weak strong | awaits weak | "
     "ready weak restarted | awaits weak | restarted 0: accepted",
     "take_overs 1"},
    {"WithoutClientsNothingIsAwaitedAndNothingRefused",
     "ready | awaits nobody | refusal none | silent: no | strong 0: unknown client",
     "rejected_client 1"},
    {"OldAnswersOfTheOnlyClientThatAnswersAreWrongSteps",
     "ready strong weak | skip 299 | weak 100: wrong step", "rejected_step 1"},

    // --- gone
    {"AClientThatIsGoneIsAwaitedOnlyIfNoOtherIsThere",
     "ready strong! weak | awaits weak | weak 0: accepted | ready strong! | awaits strong!", ""},
    {"AHeldAnswerIsTakenWhenTheAwaitedClientIsGone",
     "ready strong weak | weak 0: held | ready strong! weak | applies 0", ""},
    {"OneThatIsGoneDoesNotTakeOver", "ready strong weak! | silent: no", ""},
    {"ASilentClientIsAwaitedRatherThanOneThatIsGone",
     "ready | ready strong weak | silent: yes | silent: no | ready strong! weak | awaits weak", ""},
    {"AnAnswerBringsAClientBackThatWasGone",
     "ready strong! weak | strong 0: accepted | awaits strong", ""},
    {"ARefusalEndsTheRunAtOnceIfAllOthersAreGone",
     "ready strong! weak | weak 0 free_fall: error code | "
     "refusal controller 'weak' answered step 0 with a fault: free_fall | "
     "ready strong! | refusal none (it may come back)",
     "rejected_fault 1"},
    {"ItCountsTheAnswersOfEachClientAndKnowsWhichAreMissing",
     "ready strong weak | answers strong 0 missing | strong 0: accepted | weak 0: superseded | "
     "answers strong 1 | answers weak 1 | expect 1 | expect 2 | weak 1: late | "
     "answers weak 2 missing | weak 2 run=1: other run | "
     "answers weak 3 missing (refused, but its sender is there)",
     "superseded 1, rejected_run 1"},
};

TEST_P(CommandGateTest, JudgesAnswersByTheTable) {
  play(GetParam().events);
  EXPECT_EQ(to_string(gate().counters()), GetParam().counters);
}

INSTANTIATE_TEST_SUITE_P(Rows, CommandGateTest, testing::ValuesIn(kRows),
                         [](const auto& row) { return std::string(row.param.name); });

// --- more than a row can say ---------------------------------------------------------------------

using CommandGateSeriesTest = GateEventsTest;

TEST_F(CommandGateSeriesTest, AnyNumberThatIsNotFiniteIsRefused) {
  for (const std::string bad : {"=nan", "=inf", "=-inf"})
    for (const std::string axis : {"_x", "_y", "_z"})
      for (const std::string vector :
           {"f", "numbers", "position", "velocity", "acceleration", "jerk", "snap"})
        play("strong 0 " + vector + axis + bad + ": not finite | applies none");
  EXPECT_EQ(to_string(gate().counters()), "rejected_not_finite 63");
  const std::string refusal =
      "refusal controller 'strong' answered step 1 with a number that is not finite";
  play("expect 1 | strong 1 numbers_x=nan: not finite | " + refusal + " in controller.numbers");
  play("strong 1 jerk_x=nan: not finite | expect 2 | strong 2 jerk_x=nan: not finite");
  EXPECT_EQ(gate().refusal(),
            "controller 'strong' answered step 2 with a number that is not finite in reference");
}

// A standby that is further away than the remembered steps answers every state too late.
TEST_F(CommandGateSeriesTest, OldAnswersOfADistantStandbyAreSupersededWhileAnotherClientFlies) {
  play("ready strong weak | fly 100 strong");
  for (int step = 0; step < 200; ++step)
    play("weak " + std::to_string(step) + ": superseded | fly 1 strong");
  EXPECT_EQ(to_string(gate().counters()), "superseded 200");
  play(
      "stranger 100: wrong step (not a client) | strong 100: wrong step (the one that flies) | "
      "weak 400: wrong step (of the future) | weak 100 f_x=0 f_y=0 f_z=300: force limit");
}

TEST(CommandGateStartTest, NoAnswerIsMissingBeforeAStateIsPublished) {
  CommandGate waiting(kRun, kVehicle, {kForceLimit});
  waiting.set_clients({kStrong});
  waiting.for_each_client([](const bus::PeerId& peer, std::uint64_t answers, bool is_missing) {
    EXPECT_EQ(peer, kStrong.peer);
    EXPECT_EQ(answers, 0u);
    EXPECT_FALSE(is_missing);
  });
}

TEST(VerdictTest, EveryRejectionHasAReason) {
  std::set<std::string> texts;
  for (const Verdict verdict :
       {Verdict::kNotFinite, Verdict::kForceLimit, Verdict::kOtherRun, Verdict::kEarly,
        Verdict::kWrongStep, Verdict::kContradiction, Verdict::kUnknownVehicle,
        Verdict::kUnknownClient, Verdict::kUndefined, Verdict::kErrorCode, Verdict::kUnknownStage,
        Verdict::kEarlyEnd})
    texts.insert(to_string(verdict));
  EXPECT_EQ(texts.size(), 12u);
  EXPECT_EQ(texts.count(""), 0u);
  for (const Verdict verdict :
       {Verdict::kAccepted, Verdict::kHeld, Verdict::kDuplicate, Verdict::kSuperseded})
    EXPECT_STREQ(to_string(verdict), "");
}

// --- properties ----------------------------------------------------------------------------------

/// Invalid commands of every kind, which the gate must never accept.
class Junk {
 public:
  explicit Junk(std::mt19937_64& random) : random_(random) {}

  /// One kind is for another step, the others are for the awaited step.
  OfferedAnswer make(std::uint64_t awaited) {
    OfferedAnswer command = make_answer(awaited, -static_cast<double>(pick(40)));
    switch (pick(7)) {
      case 0:
        command.answer.f_Q_W[static_cast<int>(pick(3))] = std::numeric_limits<double>::quiet_NaN();
        break;
      case 1:
        command.answer.memory.numbers =
            Eigen::Vector2d(1.0, -std::numeric_limits<double>::infinity());
        break;
      case 2:
        command.answer.f_Q_W[static_cast<int>(pick(3))] =
            kForceLimit * 1.001 + static_cast<double>(pick(1000));
        break;
      case 3:
        command.run_id = random_();
        break;
      case 4:
        command.vehicle_id = kVehicle + 1 + static_cast<std::uint32_t>(pick(100));
        break;
      case 5:
        command.answer.error_code = static_cast<ErrorCode>(1 + pick(7));
        break;
      default:
        // Another step: far ahead, far behind, or just missed.
        command.step = pick(2) == 0 ? random_() | (1ull << 40) : awaited + 1 + pick(3);
    }
    return command;
  }

  std::uint64_t pick(std::uint64_t count) { return random_() % count; }

 private:
  std::mt19937_64& random_;
};

TEST(CommandGatePropertyTest, InvalidAnswersChangeNoForceAndAreCounted) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    Junk junk(random);
    const std::vector<ReadyClient> clients = {kWeak, kStrong, kWeakest};
    CommandGate gate(kRun, kVehicle, {kForceLimit});
    gate.set_clients(clients);
    std::uint64_t offered = 0, accepted = 0;
    constexpr std::uint64_t kSteps = 150;
    for (std::uint64_t step = 0; step < kSteps; ++step) {
      gate.expect(step);
      const OfferedAnswer strong_answer = make_answer(step, -10.0 - static_cast<double>(seed));
      struct Offer {
        OfferedAnswer command;
        bus::PeerId sender;
      };
      // Before the strongest client's answer, in any order: invalid commands of strangers, and
      // those of clients with another step, run or vehicle. After it, the clients' other invalid
      // commands.
      std::vector<Offer> before, after;
      for (std::uint64_t i = junk.pick(6); i > 0; --i) {
        before.push_back({junk.make(step), kStranger});
        const auto command = junk.make(step);
        const auto sender = clients[junk.pick(3)].peer;
        (command.step == step && command.run_id == kRun && command.vehicle_id == kVehicle ? after
                                                                                          : before)
            .push_back({command, sender});
      }
      for (std::uint64_t i = junk.pick(3); i > 0; --i) {
        before.push_back({make_answer(step, -7.0), kStranger});
        before.push_back({make_answer(step, -3.0), kWeak.peer});
        after.push_back({make_answer(step, -2.0), kWeakest.peer});
        after.push_back({strong_answer, kStrong.peer});
        if (step > 0) before.push_back({make_answer(step - 1, -3.0), kWeak.peer});
      }
      std::shuffle(before.begin(), before.end(), random);
      std::shuffle(after.begin(), after.end(), random);
      for (const Offer& offer : before) gate.offer(offer.command, offer.sender);
      ASSERT_FALSE(gate.accepted());
      ASSERT_EQ(gate.refusal(), std::nullopt);
      ASSERT_EQ(gate.offer(strong_answer, kStrong.peer), Verdict::kAccepted);
      for (const Offer& offer : after) gate.offer(offer.command, offer.sender);
      ASSERT_TRUE(gate.accepted());
      ASSERT_EQ(*gate.accepted(), strong_answer);
      offered += before.size() + 1 + after.size();
      ++accepted;
      ASSERT_EQ(offered, accepted + sum_unapplied(gate.counters())) << "step " << step;
    }
    EXPECT_EQ(accepted, kSteps);
    EXPECT_EQ(gate.counters().take_overs(), 0u);
  }
}

TEST(CommandGatePropertyTest, EveryStepIsAnsweredAsLongAsOneOfTheChangingClientsLives) {
  const std::vector<ReadyClient> everybody = {kStrong, kWeak, kWeakest};
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    CommandGate gate(kRun, kVehicle, {kForceLimit});
    gate.set_clients(everybody);
    std::uint64_t offered = 0;
    for (std::uint64_t step = 0; step < 200; ++step) {
      gate.expect(step);
      // Some announced clients are dead, some clients are not announced. At least one answers.
      std::vector<ReadyClient> announced, alive;
      while (alive.empty()) {
        announced.clear();
        for (const ReadyClient& client : everybody) {
          if (random() % 8 == 0) continue;
          announced.push_back(client);
          if (random() % 3 != 0) alive.push_back(client);
        }
      }
      gate.set_clients(announced);
      std::shuffle(alive.begin(), alive.end(), random);
      for (const ReadyClient& client : alive) {
        gate.offer(make_answer(step, -static_cast<double>(client.strength)), client.peer);
        ++offered;
      }
      while (!gate.accepted()) ASSERT_TRUE(gate.pass_over_silent_client()) << "step " << step;
      const bool is_of_the_living =
          std::any_of(alive.begin(), alive.end(), [&](const ReadyClient& client) {
            return *gate.accepted() == make_answer(step, -static_cast<double>(client.strength));
          });
      ASSERT_TRUE(is_of_the_living);
      ASSERT_EQ(offered, step + 1 + sum_unapplied(gate.counters())) << "step " << step;
    }
  }
}

}  // namespace
}  // namespace sls::sim
