#include "sim_server/core/controller_absence.hpp"

#include <gtest/gtest.h>

namespace sls::sim {
namespace {

using Action = ControllerAbsence::Action;
using config::ControllerPolicy;

config::Sync make_sync(ControllerPolicy policy, double deadline_s) {
  config::Sync sync;
  sync.wait.controller = {policy, deadline_s};
  sync.max_hold_s = 0.012;  // three periods of 4 ms
  return sync;
}

TEST(ControllerAbsenceTest, WaitingInLockstepLastsUntilTheDeadline) {
  const ControllerAbsence absence(make_sync(ControllerPolicy::kWait, 20.0));
  EXPECT_EQ(absence.decide(0.0, 0.0), Action::kWait);
  EXPECT_EQ(absence.decide(19.9, 19.9), Action::kWait);
  EXPECT_EQ(absence.decide(20.0, 20.0), Action::kGiveUp);
}

TEST(ControllerAbsenceTest, StopGivesUpAtItsDeadline) {
  const ControllerAbsence absence(make_sync(ControllerPolicy::kStop, 1.0));
  EXPECT_EQ(absence.decide(0.9, 0.9), Action::kWait);
  EXPECT_EQ(absence.decide(1.0, 1.0), Action::kGiveUp);
}

TEST(ControllerAbsenceTest, HoldFliesOnAfterTheDeadlineAndEndsInTheFailSafe) {
  ControllerAbsence absence(make_sync(ControllerPolicy::kHold, 1.0));
  EXPECT_EQ(absence.decide(0.99, 0.99), Action::kWait);
  for (int step = 0; step < 3; ++step) {
    // The first step waits for the deadline, the others for a period of wall time.
    EXPECT_EQ(absence.decide(step == 0 ? 1.0 : 0.004, 1.0), Action::kHold) << step;
    absence.flown_without_answer();
    EXPECT_EQ(absence.decide(0.003, 1.1), Action::kWait) << "a period's time to come back";
  }
  EXPECT_EQ(absence.decide(0.004, 1.1), Action::kFailSafe) << "0.012 s were held";
  EXPECT_EQ(absence.decide(0.004, 30.0), Action::kGiveUp) << "wait_for.timeout_s";
}

TEST(ControllerAbsenceTest, AnAnswerEndsTheAbsence) {
  ControllerAbsence absence(make_sync(ControllerPolicy::kHold, 1.0));
  absence.flown_without_answer();
  EXPECT_TRUE(absence.is_acting());
  absence.answered();
  EXPECT_FALSE(absence.is_acting());
  EXPECT_EQ(absence.decide(0.5, 0.5), Action::kWait) << "the deadline counts anew";
}

TEST(ControllerAbsenceTest, FailsafeDoesNotHold) {
  const ControllerAbsence absence(make_sync(ControllerPolicy::kFailsafe, 1.0));
  EXPECT_EQ(absence.decide(1.0, 1.0), Action::kFailSafe);
}

TEST(ControllerAbsenceTest, RealTimeNeverWaits) {
  for (const auto policy : {ControllerPolicy::kWait, ControllerPolicy::kHold,
                            ControllerPolicy::kFailsafe, ControllerPolicy::kStop}) {
    config::Sync sync = make_sync(policy, 5.0);
    sync.mode = config::SyncMode::kRealtime;
    ControllerAbsence absence(sync);
    for (int step = 0; step < 3; ++step) {
      EXPECT_EQ(absence.decide(0.0, 0.004 * step), Action::kHold);
      absence.flown_without_answer();
    }
    EXPECT_EQ(absence.decide(0.0, 0.012), Action::kFailSafe);
    EXPECT_EQ(absence.decide(0.0, 30.0), Action::kGiveUp);
  }
}

}  // namespace
}  // namespace sls::sim
