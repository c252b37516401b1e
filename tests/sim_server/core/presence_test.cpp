#include "sim_server/core/participants/presence.hpp"

#include <gtest/gtest.h>

namespace sls::sim {
namespace {

using namespace std::chrono_literals;
using Entry = sync::Member;

/// One controller, looked at ten times a second.
class PresenceTest : public testing::Test {
 protected:
  PresenceTest() { entry_.peer.bytes.fill(1); }

  void announce() { entry_.heard = now_; }
  void answer() { ++answering_.answers; }

  bool look(std::chrono::milliseconds later = 100ms) {
    now_ += later;
    std::vector<Entry> entries{entry_};
    presence_.look(entries, {{entry_.peer, answering_}}, now_);
    return entries.front().is_gone;
  }
  /// @returns true if the controller is gone after `time` in which it says nothing.
  bool is_gone_after(std::chrono::milliseconds time) {
    bool is_gone = false;
    for (auto passed = 0ms; passed < time; passed += 100ms) is_gone = look();
    return is_gone;
  }

  Presence presence_;
  Entry entry_;
  Answering answering_;
  Presence::Clock::time_point now_{1h};
};

TEST_F(PresenceTest, OneThatRepeatsItsAnnouncementIsGoneAfterTwoSecondsOfSilence) {
  entry_.is_repeated = true;
  EXPECT_FALSE(look());
  for (int i = 0; i < 100; ++i) {
    announce();
    ASSERT_FALSE(is_gone_after(500ms));
  }
  EXPECT_FALSE(is_gone_after(1400ms));
  EXPECT_TRUE(is_gone_after(200ms));
  announce();
  EXPECT_FALSE(look()) << "heard again";
}

TEST_F(PresenceTest, OneThatAnnouncesOnceMayWaitForTheStartWithoutAWord) {
  EXPECT_FALSE(look());
  EXPECT_FALSE(is_gone_after(60s));
}

TEST_F(PresenceTest, OneThatAnnouncesOnceIsGoneWhenItLeavesAStateUnanswered) {
  EXPECT_FALSE(look());
  answering_.is_asked = true;
  EXPECT_FALSE(is_gone_after(1900ms));
  EXPECT_TRUE(is_gone_after(300ms));
  answer();
  EXPECT_FALSE(look()) << "its answer counts";
}

TEST_F(PresenceTest, AnswersThatAreAllLateAreSignsOfLife) {
  answering_.is_asked = true;  // the state in work never has its answer
  for (int i = 0; i < 100; ++i) {
    answer();
    ASSERT_FALSE(is_gone_after(1000ms));
  }
}

TEST_F(PresenceTest, AnswersAreSignsOfLifeAlsoOfOneThatRepeatedItsAnnouncement) {
  entry_.is_repeated = true;
  for (int i = 0; i < 10; ++i) {
    answer();
    ASSERT_FALSE(is_gone_after(1000ms));
  }
}

TEST_F(PresenceTest, APauseIsNoSilenceOfOneThatHasAnswered) {
  answering_.is_asked = true;
  answer();
  EXPECT_FALSE(is_gone_after(1500ms));
  answer();
  answering_.is_asked = false;
  EXPECT_FALSE(is_gone_after(60s));
  answering_.is_asked = true;
  EXPECT_FALSE(is_gone_after(1900ms)) << "counts from the next state on";
}

TEST_F(PresenceTest, OneThatLeftAndCameBackIsNew) {
  entry_.is_repeated = true;
  EXPECT_TRUE(is_gone_after(3s));
  std::vector<Entry> none;
  presence_.look(none, {}, now_ += 100ms);
  EXPECT_FALSE(look());
}

}  // namespace
}  // namespace sls::sim
