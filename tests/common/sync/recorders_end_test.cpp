#include "common/sync/recorders_end.hpp"

#include <gtest/gtest.h>

#include "tests/common/sync/samples.hpp"

namespace sls::sync {
namespace {

/// One recorder that has complete rows up to `step`, heard at `ms`.
std::vector<Member> recorder_at(std::int64_t step, std::int64_t ms, bool is_done = false) {
  Member member;
  member.peer = peer(1);
  member.announcement = recorder(step, is_done);
  member.heard = at(ms);
  return {member};
}

TEST(RecordersEndTest, EndsWithTheLastRecorder) {
  RecordersEnd end(at(0), 1, {10, 60});
  EXPECT_FALSE(end.is_over({}, 0, false, at(0))) << "none has been discovered";
  EXPECT_FALSE(end.is_over(recorder_at(5, 0), 0, false, at(1)));
  EXPECT_TRUE(end.is_over(recorder_at(5, 0, true), 1, false, at(2)));
  EXPECT_TRUE(RecordersEnd(at(0), 1, {10, 60}).is_over({}, 1, false, at(0))) << "it has left, done";
  EXPECT_TRUE(RecordersEnd(at(0), 0, {10, 60}).is_over({}, 0, false, at(0))) << "none is expected";
}

TEST(RecordersEndTest, ASilentRecorderHoldsNothingUpIfAnotherOneIsDone) {
  RecordersEnd end(at(0), 1, {10, 60});
  auto recorders = recorder_at(5, 0);
  recorders.push_back(recorder_at(9, 0, true).front());
  EXPECT_FALSE(end.is_over(recorders, 1, false, at(2000)));
  EXPECT_TRUE(end.is_over(recorders, 1, false, at(2000) + 1ns));
}

TEST(RecordersEndTest, OneThatGetsFurtherIsWaitedForButNotForEver) {
  RecordersEnd end(at(0), 1, {10, 60});
  std::int64_t step = 0;
  for (std::int64_t ms = 0; ms < 60'000; ms += 9999)
    EXPECT_FALSE(end.is_over(recorder_at(++step, ms), 0, false, at(ms))) << ms;
  EXPECT_FALSE(end.is_over(recorder_at(++step, 59'999), 0, false, at(59'999)));
  EXPECT_TRUE(end.is_over(recorder_at(++step, 60'000), 0, false, at(60'000)));
}

TEST(RecordersEndTest, OneThatGetsNoFurtherIsNot) {
  RecordersEnd end(at(0), 1, {10, 60});
  EXPECT_FALSE(end.is_over(recorder_at(5, 9'999), 0, false, at(9'999)));
  EXPECT_TRUE(end.is_over(recorder_at(5, 10'000), 0, false, at(10'000)));
}

TEST(RecordersEndTest, AfterAStopSignalProgressBuysNoTime) {
  RecordersEnd end(at(0), 1, {10, 60});
  EXPECT_FALSE(end.is_over(recorder_at(5, 0), 0, true, at(0)));
  EXPECT_FALSE(end.is_over(recorder_at(6, 5000), 0, true, at(5000)));
  EXPECT_TRUE(end.is_over(recorder_at(7, 10'000), 0, true, at(10'000)));
}

TEST(RecordersEndTest, TheMissingOneIsNamedAfterASecondAndThenEveryFive) {
  RecordersEnd end(at(0), 1, {10, 60});
  EXPECT_FALSE(end.take_report(recorder_at(5, 0), at(999)));
  auto recorders = recorder_at(5, 0);
  recorders.push_back(recorder_at(9, 0, true).front());  // it is done
  EXPECT_EQ(end.take_report(recorders, at(1000)),
            "waiting for: recorder 'pilot' on here to finish (9 s left)");
  EXPECT_FALSE(end.take_report(recorder_at(5, 0), at(5999)));
  EXPECT_EQ(end.take_report({}, at(6000)), "waiting for: recorder (gone) to finish (4 s left)");
}

}  // namespace
}  // namespace sls::sync
