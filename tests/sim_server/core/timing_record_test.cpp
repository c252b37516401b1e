#include "sim_server/core/report/timing_record.hpp"

#include <gtest/gtest.h>

namespace sls::sim {
namespace {

TimingRecord make_record(config::SyncMode mode) {
  config::Sync sync;
  sync.mode = mode;
  return TimingRecord(sync);
}

TEST(TimingRecordTest, LockstepIsExactWhileEveryForceIsAnAnswer) {
  TimingRecord record = make_record(config::SyncMode::kLockstep);
  EXPECT_EQ(record.label(), "exact");
  for (int i = 0; i < 100; ++i) record.add(model::AnswerKind::kAccepted, 0);
  EXPECT_EQ(record.label(), "exact");
}

TEST(TimingRecordTest, LockstepThatFlewWithoutAnswersIsDegraded) {
  TimingRecord record = make_record(config::SyncMode::kLockstep);
  record.add(model::AnswerKind::kHeld, 1);
  record.add(model::AnswerKind::kHeld, 2);
  record.add(model::AnswerKind::kFailSafe, 3);
  EXPECT_EQ(record.label(), "degraded: 2 steps held, 1 fail-safe");
  SyncCounters counters;
  record.fill(counters);
  EXPECT_EQ(counters.held(), 2u);
  EXPECT_EQ(counters.fail_safe(), 1u);
  EXPECT_EQ(counters.late(), 0u) << "lockstep knows no late answers";
}

TEST(TimingRecordTest, RealTimeSaysHowManyWereLateAndHowOldTheWorstForceWas) {
  TimingRecord record = make_record(config::SyncMode::kRealtime);
  for (int i = 0; i < 998; ++i) record.add(model::AnswerKind::kAccepted, 0);
  record.add(model::AnswerKind::kHeld, 1);
  record.add(model::AnswerKind::kHeld, 2);
  record.add_delay(0.0004);
  record.add_delay(0.0001);
  EXPECT_EQ(record.label(),
            "real-time, 2 of 1000 late, worst age 8 ms, states at most 0.4 ms late");
  SyncCounters counters;
  record.fill(counters);
  EXPECT_EQ(counters.late(), 2u);
}

TEST(TimingRecordTest, RealTimeIsDegradedByFailSafeSlipsAndStatesThatWereNotPublished) {
  for (int defect = 0; defect < 3; ++defect) {
    TimingRecord record = make_record(config::SyncMode::kRealtime);
    if (defect == 0) record.add(model::AnswerKind::kFailSafe, 9);
    if (defect == 1) record.add_slip(0.25);
    if (defect == 2) record.set_overflow(3);
    EXPECT_EQ(record.label().rfind("degraded: real-time, ", 0), 0u) << record.label();
    const char* words[] = {"1 fail-safe", "0.25 s lost in 1 slips", "3 samples unpublished"};
    EXPECT_NE(record.label().find(words[defect]), std::string::npos) << record.label();
  }
}

}  // namespace
}  // namespace sls::sim
