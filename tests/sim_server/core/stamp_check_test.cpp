#include "sim_server/core/participants/stamp_check.hpp"

#include <gtest/gtest.h>

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

bus::PeerId make_peer(int number) {
  bus::PeerId peer;
  peer.bytes[0] = static_cast<std::uint8_t>(number);
  return peer;
}

class StampCheckTest : public testing::Test {
 protected:
  void note(int sender, StampCheck::Clock::duration ahead) {
    check_.note(make_peer(sender), now_ + ahead, [this] {
      ++readings_;
      return now_;
    });
  }

  StampCheck check_;
  StampCheck::Clock::time_point now_{1000h};
  int readings_ = 0;
};

TEST_F(StampCheckTest, ClocksThatDifferByASecondAreInOrder) {
  for (int i = 0; i < 100; ++i, now_ += 300ms)
    for (const auto ahead : {0ms, 900ms, -1500ms, 1000ms}) note(1, ahead);
  EXPECT_TRUE(check_.take().empty());
}

TEST_F(StampCheckTest, StampsInTheFutureAreKeptUntilTheyAreTaken) {
  note(1, 0s);
  note(2, 5s);
  note(3, 3600s);
  note(2, 6s);
  const auto found = check_.take();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_DOUBLE_EQ(found.at(make_peer(2)), 6.0);
  EXPECT_DOUBLE_EQ(found.at(make_peer(3)), 3600.0);
  EXPECT_TRUE(check_.take().empty());
  note(2, 5s);
  EXPECT_EQ(check_.take().size(), 1u);
}

TEST_F(StampCheckTest, TheClockIsReadOnceASecond) {
  for (int i = 0; i < 10000; ++i, now_ += 1ms) note(1, 0s);
  EXPECT_LE(readings_, 11);
}

TEST_F(StampCheckTest, SendersCannotFillTheMemory) {
  for (int i = 0; i < 200; ++i) note(i, 5s);
  note(0, 6s);
  const auto found = check_.take();
  EXPECT_EQ(found.size(), StampCheck::kMostSenders);
  EXPECT_DOUBLE_EQ(found.at(make_peer(0)), 6.0) << "a known one is still noted";
}

}  // namespace
}  // namespace sls::sim
