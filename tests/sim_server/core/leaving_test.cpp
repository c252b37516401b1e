#include "sim_server/core/leaving.hpp"

#include <gtest/gtest.h>

#include "tests/common/sync/samples.hpp"

namespace sls::sim {
namespace {

using sync::at;

/// One recorder that has complete rows up to `step`, heard at `ms`.
std::vector<sync::Member> recorder_at(std::int64_t step, std::int64_t ms, bool is_done = false) {
  sync::Member member;
  member.peer = sync::peer(1);
  member.announcement = sync::recorder(step, is_done);
  member.heard = at(ms);
  return {member};
}

Leaving expect(int recorders) { return Leaving(recorders, true, at(0)); }

TEST(LeavingTest, EndsWithTheLastRecorder) {
  Leaving leaving = expect(1);
  EXPECT_FALSE(leaving.look({{}, 0, false, true}, at(0))) << "none has been discovered";
  EXPECT_FALSE(leaving.look({recorder_at(5, 0), 0, false, true}, at(1)));
  EXPECT_TRUE(leaving.look({recorder_at(5, 0, true), 1, false, true}, at(2)));
  EXPECT_TRUE(expect(1).look({{}, 1, false, true}, at(0))) << "it has left, done";
  EXPECT_TRUE(expect(0).look({{}, 0, false, true}, at(0))) << "none is expected";
}

TEST(LeavingTest, ThenWaitsTwoSecondsForAcknowledgements) {
  Leaving leaving = expect(1);
  EXPECT_FALSE(leaving.look({{}, 0, false, true}, at(0)));
  EXPECT_FALSE(leaving.look({{}, 1, false, false}, at(3000)));
  EXPECT_FALSE(leaving.look({{}, 1, false, false}, at(4999)));
  EXPECT_TRUE(leaving.look({{}, 1, false, false}, at(5000)));
  EXPECT_EQ(leaving.error(), "");
}

TEST(LeavingTest, ASilentRecorderHoldsNothingUpIfAnotherOneIsDone) {
  Leaving leaving = expect(1);
  auto recorders = recorder_at(5, 0);
  recorders.push_back(recorder_at(9, 0, true).front());
  EXPECT_FALSE(leaving.look({recorders, 1, false, true}, at(2000)));
  EXPECT_TRUE(leaving.look({recorders, 1, false, true}, at(2000) + std::chrono::nanoseconds(1)));
}

TEST(LeavingTest, OneThatGetsFurtherIsWaitedForButNotForEver) {
  Leaving leaving = expect(1);
  std::int64_t step = 0;
  for (std::int64_t ms = 0; ms < 60'000; ms += 9999)
    EXPECT_FALSE(leaving.look({recorder_at(++step, ms), 0, false, true}, at(ms))) << ms;
  EXPECT_FALSE(leaving.look({recorder_at(++step, 59'999), 0, false, true}, at(59'999)));
  EXPECT_TRUE(leaving.look({recorder_at(++step, 60'000), 0, false, true}, at(60'000)));
}

TEST(LeavingTest, AfterAStopSignalProgressBuysNoTime) {
  Leaving leaving = expect(1);
  EXPECT_FALSE(leaving.look({recorder_at(5, 0), 0, true, true}, at(0)));
  EXPECT_FALSE(leaving.look({recorder_at(6, 5000), 0, true, true}, at(5000)));
  EXPECT_TRUE(leaving.look({recorder_at(7, 10'000), 0, true, true}, at(10'000)));
}

TEST(LeavingTest, AMissingRecorderIsNamedAndIsAFailureUnlessTheFlightMayLackIt) {
  const std::string gave_up =
      "the recording is not complete: gave up waiting for recorder 'pilot' on here";
  for (const bool is_failure : {true, false}) {
    Leaving leaving(1, is_failure, at(0));
    const auto look = [&](std::int64_t heard, std::int64_t now) {
      auto recorders = recorder_at(5, heard);
      recorders.push_back(recorder_at(9, heard, true).front());  // it is done
      recorders.back().peer = sync::peer(2);
      const bool is_over = leaving.look({recorders, 0, false, true}, at(now));
      const auto lines = leaving.take_lines();
      return (is_over ? "over " : "") + (lines.empty() ? "" : lines.front().text);
    };
    EXPECT_EQ(look(0, 999), "");
    EXPECT_EQ(look(0, 1000), "waiting for: recorder 'pilot' on here to finish (9 s left)");
    EXPECT_EQ(look(5000, 5999), "");
    EXPECT_EQ(look(3000, 6000),
              "waiting for: recorder 'pilot' on here (gone) to finish (4 s left)");
    EXPECT_EQ(look(9000, 10'000), is_failure ? "over " : "over " + gave_up);
    EXPECT_EQ(leaving.error(), is_failure ? gave_up : "");
  }
  Leaving leaving = expect(1);
  EXPECT_TRUE(leaving.look({{}, 0, false, true}, at(10'000)));
  EXPECT_EQ(leaving.error(), "the recording is not complete: gave up waiting for recorder (gone)");
}

}  // namespace
}  // namespace sls::sim
