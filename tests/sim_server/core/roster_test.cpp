#include "sim_server/core/participants/roster.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "sim_server/core/participants/surroundings.hpp"

namespace sls::sim {
namespace {

const std::string kScenario(64, 'a');
const std::string kOtherScenario(64, 'b');

sync::Member make_entry(ParticipantRole role, const std::string& name, bool ready) {
  static std::uint8_t number = 0;
  sync::Member entry;
  entry.peer.bytes.fill(++number);
  entry.announcement.role(role);
  entry.announcement.name(name);
  entry.announcement.host("host-of-" + name);
  entry.announcement.scenario_sha256(kScenario);
  entry.announcement.ready(ready);
  entry.announcement.last_complete_step(-1);
  entry.heard = sync::Time();
  return entry;
}

sync::Member make_controller(const std::string& name, bool ready = true) {
  auto entry = make_entry(ParticipantRole::ROLE_CONTROLLER, name, ready);
  entry.announcement.vehicle_ids({0});
  return entry;
}
sync::Member make_recorder(const std::string& name, bool ready = true) {
  return make_entry(ParticipantRole::ROLE_RECORDER, name, ready);
}
sync::Member make_recorder_at(std::int64_t last_complete_step) {
  auto entry = make_recorder("tape");
  entry.announcement.last_complete_step(last_complete_step);
  return entry;
}

config::WaitFor make_wait_for(int controllers, int recorders) {
  config::WaitFor wait_for;
  wait_for.controllers = controllers;
  wait_for.recorders = recorders;
  return wait_for;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(RosterTest, MoreThanExpectedIsFine) {
  const Roster roster = {{make_controller("a"), make_controller("b", false), make_controller("c")},
                         {make_recorder("d"), make_recorder("e")}};
  EXPECT_EQ(name_missing(roster, make_wait_for(2, 1), kScenario), "");
  EXPECT_EQ(name_missing({}, make_wait_for(0, 0), kScenario), "");
}

TEST(RosterTest, NamesTheRolesThatAreMissing) {
  EXPECT_EQ(name_missing({}, make_wait_for(1, 1), kScenario), "controller, recorder");
  EXPECT_EQ(name_missing({{make_controller("pilot")}, {}}, make_wait_for(1, 1), kScenario),
            "recorder");
  EXPECT_EQ(name_missing({{}, {make_recorder("tape")}}, make_wait_for(1, 1), kScenario),
            "controller");
}

TEST(RosterTest, CountsWhereSeveralAreExpected) {
  const Roster roster = {{make_controller("pilot")}, {make_recorder("tape")}};
  const std::string missing = name_missing(roster, make_wait_for(3, 2), kScenario);
  EXPECT_TRUE(contains(missing, "3 controllers (1 ready)")) << missing;
  EXPECT_TRUE(contains(missing, "2 recorders (1 ready)")) << missing;
}

TEST(RosterTest, NamesParticipantsThatAreNotReady) {
  const Roster roster = {{make_controller("pilot", false)}, {make_recorder("tape", false)}};
  const std::string missing = name_missing(roster, make_wait_for(1, 1), kScenario);
  EXPECT_TRUE(contains(missing, "'pilot' on host-of-pilot is not ready")) << missing;
  EXPECT_TRUE(contains(missing, "'tape' on host-of-tape is not ready")) << missing;
}

TEST(RosterTest, NamesAControllerWithAnotherScenario) {
  Roster roster = {{make_controller("pilot")}, {make_recorder("tape")}};
  roster.controllers[0].announcement.scenario_sha256(kOtherScenario);
  const std::string missing = name_missing(roster, make_wait_for(1, 1), kScenario);
  EXPECT_TRUE(contains(missing, "'pilot' on host-of-pilot has another scenario")) << missing;
  EXPECT_FALSE(contains(missing, "tape")) << missing;
}

TEST(RosterTest, OnlyReadyControllersWithThisScenarioMayAnswer) {
  Roster roster = {{make_controller("unready", false), make_controller("pilot"),
                    make_controller("other"), make_controller("without")},
                   {}};
  roster.controllers[1].announcement.strength(-7);
  roster.controllers[2].announcement.scenario_sha256(kOtherScenario);
  roster.controllers[3].announcement.scenario_sha256("");
  const auto clients = find_ready_clients(roster, kScenario);
  ASSERT_EQ(clients.size(), 1u);
  EXPECT_EQ(clients[0].name, "pilot");
  EXPECT_EQ(clients[0].strength, -7);
  EXPECT_EQ(clients[0].peer, roster.controllers[1].peer);
}

TEST(RosterTest, AControllerThatIsGoneDoesNotCountAndIsNamed) {
  Roster roster = {{make_controller("pilot")}, {}};
  roster.controllers[0].is_gone = true;
  EXPECT_EQ(name_missing(roster, make_wait_for(1, 0), kScenario), "controller ['pilot' (gone)]");
  const auto clients = find_ready_clients(roster, kScenario);
  ASSERT_EQ(clients.size(), 1u) << "it may come back with an answer";
  EXPECT_TRUE(clients[0].is_gone);
  roster.controllers.push_back(make_controller("other"));
  EXPECT_EQ(name_missing(roster, make_wait_for(1, 0), kScenario), "");
}

TEST(RosterTest, ARecorderThatIsGoneDoesNotCountAndIsNamed) {
  Roster roster = {{}, {make_recorder("tape")}};
  roster.recorders[0].heard -= 2 * sync::kPresumedDeadAfter;
  EXPECT_EQ(name_missing(roster, make_wait_for(0, 1), kScenario), "recorder ['tape' (gone)]");
  roster.recorders.push_back(make_recorder("other"));
  EXPECT_EQ(name_missing(roster, make_wait_for(0, 1), kScenario), "");
}

TEST(RosterTest, TheWindowIsSmallerWhereTheHistoryIs) {
  EXPECT_EQ(calc_recorder_window(5000), kRecorderWindow);
  EXPECT_EQ(calc_recorder_window(1000000), kRecorderWindow);
  EXPECT_EQ(calc_recorder_window(1000), 400);
  EXPECT_EQ(calc_recorder_window(1), 1);
  EXPECT_EQ(name_blocking_recorder({{}, {make_recorder_at(-1)}}, 1, 399, 400), "");
  EXPECT_NE(name_blocking_recorder({{}, {make_recorder_at(-1)}}, 1, 400, 400), "");
}

TEST(RosterTest, ABlockingRecorderIsNamedWithHowFarItIsBehind) {
  const std::string blocking = name_blocking_recorder({{}, {make_recorder_at(999)}}, 1, 3500);
  EXPECT_TRUE(contains(blocking, "recorder 'tape' on host-of-tape")) << blocking;
  EXPECT_TRUE(contains(blocking, "2500 steps behind")) << blocking;
}

TEST(RosterTest, TheSlowestOfSeveralRecordersBlocks) {
  const Roster roster = {{}, {make_recorder_at(4000), make_recorder_at(1)}};
  EXPECT_EQ(name_blocking_recorder(roster, 1, 2001), "");
  EXPECT_NE(name_blocking_recorder(roster, 1, 2002), "");
}

TEST(RosterTest, ARecorderThatIsNotReadyDoesNotBlockWhereNoneIsExpected) {
  EXPECT_EQ(name_blocking_recorder({{}, {make_recorder("tape", false)}}, 0, 100000), "");
}

TEST(RosterTest, ImpossibleProgressIsClampedToThePlausibleRange) {
  const auto lowest = std::numeric_limits<std::int64_t>::min();
  const auto highest = std::numeric_limits<std::int64_t>::max();
  EXPECT_NE(name_blocking_recorder({{}, {make_recorder_at(lowest)}}, 1, 2000), "");
  EXPECT_EQ(name_blocking_recorder({{}, {make_recorder_at(lowest)}}, 1, 0), "");
  EXPECT_EQ(name_blocking_recorder({{}, {make_recorder_at(highest)}}, 1, 0), "");
}

TEST(RosterTest, ARecorderPresumedDeadDoesNotBlockIfAnotherIsThere) {
  auto dead = make_recorder_at(10);
  dead.heard -= 2 * sync::kPresumedDeadAfter;
  EXPECT_EQ(name_blocking_recorder({{}, {dead, make_recorder_at(4999)}}, 1, 5000), "");
  EXPECT_NE(name_blocking_recorder({{}, {dead}}, 1, 20), "") << "one is expected";
}

TEST(RosterTest, ARecorderThatComesDuringTheFlightStopsItOnlyInThePlaceOfOneThatIsGone) {
  Roster roster = {{}, {make_recorder_at(4999), make_recorder_at(-1)}};
  roster.began = std::chrono::steady_clock::now();
  roster.recorders[1].ready_since = *roster.began + std::chrono::seconds(1);
  EXPECT_EQ(name_blocking_recorder(roster, 1, 5000), "");
  EXPECT_NE(name_blocking_recorder(roster, 2, 5000), "") << "two are expected";
  roster.recorders[0].heard -= 2 * sync::kPresumedDeadAfter;
  EXPECT_NE(name_blocking_recorder(roster, 1, 5000), "") << "it is the only one now";
  // The most advanced of several recorders counts as the replacement.
  roster.recorders.push_back(make_recorder_at(4900));
  roster.recorders[2].ready_since = roster.recorders[1].ready_since;
  EXPECT_EQ(name_blocking_recorder(roster, 1, 5000), "");
}

TEST(RosterTest, ARecorderThatLagsAndAnnouncesNothingIsNamedAsSilent) {
  const auto now = std::chrono::steady_clock::now();
  const auto second = std::chrono::seconds(1);
  auto recorder = make_recorder_at(100);
  recorder.heard = now - 2 * second;
  const Roster roster = {{}, {recorder}};
  EXPECT_TRUE(contains(name_silent_recorder(roster, 500, now - second), "'tape'"));
  EXPECT_TRUE(contains(name_silent_recorder(roster, 500, now - second), "step 100"));
  EXPECT_EQ(name_silent_recorder(roster, 500, now - 3 * second), "") << "heard since";
  EXPECT_EQ(name_silent_recorder(roster, 101, now - second), "") << "nothing to announce";
  recorder.announcement.ready(false);
  EXPECT_EQ(name_silent_recorder({{}, {recorder}}, 500, now - second), "") << "it is not ready";
}

TEST(RosterTest, ADeadRecorderThatAnotherHasReplacedIsNotNamedAsSilent) {
  auto dead = make_recorder_at(100), next = make_recorder_at(499), unready = make_recorder("new");
  dead.heard -= 2 * sync::kPresumedDeadAfter;
  unready.announcement.ready(false);
  EXPECT_EQ(name_silent_recorder({{}, {dead, next}}, 500, sync::Time()), "");
  EXPECT_TRUE(contains(name_silent_recorder({{}, {dead}}, 500, sync::Time()), "step 100"));
  EXPECT_TRUE(contains(name_silent_recorder({{}, {dead, unready}}, 500, sync::Time()), "step 100"));
}

// --- fleets --------------------------------------------------------------------------------------

sync::Member make_pilot(const std::string& name, const std::vector<std::uint32_t>& vehicle_ids) {
  auto entry = make_controller(name);
  entry.announcement.vehicle_ids(vehicle_ids);
  return entry;
}

TEST(RosterTest, ControllersAreReadyForTheirOwnVehicles) {
  const Roster roster = {{make_pilot("low", {0, 1}), make_pilot("high", {1, 2})}, {}};
  const auto name_ready = [&](std::uint32_t id) {
    std::string names;
    for (const auto& client : find_ready_clients(roster, kScenario, id)) names += client.name + " ";
    return names;
  };
  EXPECT_EQ(name_ready(0), "low ");
  EXPECT_EQ(name_ready(1), "low high ");
  EXPECT_EQ(name_ready(2), "high ");
  EXPECT_EQ(name_ready(3), "");
}

TEST(RosterTest, AControllerThatListsNoVehiclesFliesNone) {
  auto entry = make_controller("foreign");
  entry.announcement.vehicle_ids().clear();
  EXPECT_TRUE(find_ready_clients({{entry}, {}}, kScenario, 0).empty());
}

TEST(RosterTest, VehiclesWithoutAControllerAreNamed) {
  const Roster roster = {{make_pilot("low", {0, 1, 2}), make_pilot("one", {5})}, {}};
  const std::string missing =
      name_missing(roster, make_wait_for(1, 0), kScenario, {0, 1, 2, 3, 4, 5, 6});
  EXPECT_TRUE(contains(missing, "controller")) << missing;
  EXPECT_TRUE(contains(missing, "vehicles without: 3-4,6")) << missing;
  EXPECT_EQ(name_missing(roster, make_wait_for(1, 0), kScenario, {0, 1, 2, 5}), "");
}

TEST(RosterTest, TheLimitIsTheFirstStepThatARecorderBlocks) {
  for (const std::int64_t window : {1, 10, 2000})
    for (const std::int64_t last : {-1, 0, 7, 5000}) {
      const Roster roster = {{}, {make_recorder_at(last), make_recorder_at(last + 3)}};
      const std::uint64_t limit = calc_recorder_limit(roster, 2, window);
      EXPECT_NE(name_blocking_recorder(roster, 2, limit, window), "");
      ASSERT_GT(limit, 0u);
      EXPECT_EQ(name_blocking_recorder(roster, 2, limit - 1, window), "");
    }
}

TEST(RosterTest, WithoutTheExpectedRecordersNoStepIsWithinTheLimit) {
  EXPECT_EQ(calc_recorder_limit({{}, {make_recorder_at(5)}}, 2), 0u);
}

TEST(RosterTest, AControllerWhoseReaderOrWriterIsNotMatchedYetIsLeftOut) {
  const auto matched = make_controller("matched"), deaf = make_controller("deaf");
  const auto dumb = make_controller("dumb");
  std::vector<sync::Member> controllers = {deaf, matched, dumb};
  keep_matched(controllers, {matched.peer, dumb.peer}, {matched.peer, deaf.peer});
  ASSERT_EQ(controllers.size(), 1u);
  EXPECT_EQ(controllers.front().peer, matched.peer);
}

TEST(RosterTest, WithoutRecordersNoStepIsBeyondTheLimit) {
  EXPECT_GT(calc_recorder_limit({}, 0), std::uint64_t{1} << 62);
}

}  // namespace
}  // namespace sls::sim
