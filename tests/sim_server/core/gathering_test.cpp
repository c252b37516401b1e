#include "sim_server/core/gathering.hpp"

#include <gtest/gtest.h>

#include "tests/common/sync/samples.hpp"

namespace sls::sim {
namespace {

using sync::at;
using Finding = Gathering::Finding;

config::WaitFor expect(int controllers, int recorders, double timeout_s) {
  config::WaitFor expected;
  expected.controllers = controllers;
  expected.recorders = recorders;
  expected.timeout_s = timeout_s;
  return expected;
}

/// Waits for one controller of vehicle 4, no recorder, for 30 s from time 0 on.
class GatheringTest : public testing::Test {
 protected:
  Finding look(std::int64_t ms) {
    roster_.now = at(ms);
    return gathering_.look(roster_, roster_.now);
  }
  void join(bool is_ready) {
    sync::Member member;
    member.announcement = sync::controller();
    member.announcement.scenario_sha256("sha");
    member.announcement.vehicle_ids({sync::kVehicle});
    member.announcement.ready(is_ready);
    roster_.controllers = {member};
  }

  Gathering gathering_{expect(1, 0, 30), "sha", {sync::kVehicle}, at(0)};
  Roster roster_;
};

TEST_F(GatheringTest, EndsAtTheLookThatFindsEverybody) {
  EXPECT_EQ(look(0), Finding::kMissing);
  join(false);
  EXPECT_EQ(look(5), Finding::kMissing);
  EXPECT_EQ(gathering_.missing(), "controller ['pilot' on here is not ready]");
  join(true);
  EXPECT_EQ(look(10), Finding::kReady);
  EXPECT_EQ(Gathering(expect(0, 0, 30), "sha", {sync::kVehicle}, at(0)).look(roster_, at(0)),
            Finding::kReady);
}

TEST_F(GatheringTest, GivesUpAfterItsTimeoutAndSaysWhoIsMissing) {
  EXPECT_EQ(look(29'999), Finding::kMissing);
  EXPECT_EQ(look(30'000), Finding::kGivenUp);
  EXPECT_EQ(gathering_.describe_error(), "not ready within 30 s: controller");
  join(true);
  EXPECT_EQ(look(30'001), Finding::kReady) << "one that is there at the last look flies";
}

TEST_F(GatheringTest, ReportsAfterTheUsualTimeThenEveryFiveSecondsAndNamesTheDoctorOfLongStarts) {
  look(299);
  EXPECT_FALSE(gathering_.take_report(at(299)));
  auto report = gathering_.take_report(at(300));
  ASSERT_TRUE(report);
  EXPECT_EQ(report->text, "waiting for: controller (30 s left)");
  EXPECT_EQ(report->hint, "");
  EXPECT_TRUE(report->is_news);
  EXPECT_FALSE(gathering_.take_report(at(5299)));
  report = gathering_.take_report(at(5300));
  EXPECT_EQ(report->text, "waiting for: controller (25 s left)");
  EXPECT_EQ(report->hint, "; run ./sls doctor");
  EXPECT_FALSE(report->is_news) << "sls/status said so already";
  join(false);
  look(10'300);
  EXPECT_TRUE(gathering_.take_report(at(10'300))->is_news);
}

}  // namespace
}  // namespace sls::sim
