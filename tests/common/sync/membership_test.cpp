#include "common/sync/membership.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "tests/common/sync/samples.hpp"

namespace sls::sync {
namespace {

constexpr auto kController = ParticipantRole::ROLE_CONTROLLER;

class MembershipTest : public testing::Test {
 protected:
  MembershipTest() { members_.set_present({peer(1), peer(2)}); }

  /// `sample` is written at `ms` by the sender's clock and arrives `age_ms` later.
  void note(const Participant& sample, std::int64_t ms, std::int64_t age_ms = 0, int sender = 1) {
    members_.note(
        sample, peer(static_cast<std::uint8_t>(sender)),
        {at(ms + age_ms), std::chrono::system_clock::time_point(1000h) + ms * 1ms, age_ms * 1ms});
  }
  std::optional<Member> find() const {
    const auto found = members_.find(kController, kRun);
    return found.empty() ? std::nullopt : std::optional(found.front());
  }

  Membership members_;
};

TEST_F(MembershipTest, ListsTheParticipantsOfARunUntilTheyLeave) {
  note(controller(0), 0);
  note(controller(), 1);  // replaces the first
  ASSERT_EQ(members_.find(kController, kRun).size(), 1u);
  EXPECT_EQ(find()->peer, peer(1));
  EXPECT_TRUE(members_.find(ParticipantRole::ROLE_RECORDER, kRun).empty());
  EXPECT_TRUE(members_.find(kController, kRun + 1).empty());
  Participant done = controller();
  done.done(true);
  EXPECT_EQ(members_.count_done(kController, kRun), 0);
  note(done, 2);
  EXPECT_EQ(members_.count_done(ParticipantRole::ROLE_RECORDER, kRun), 0);
  EXPECT_EQ(members_.count_done(kController, kRun + 1), 0);
  members_.set_present({peer(2)});
  EXPECT_FALSE(find());
  EXPECT_EQ(members_.count_done(kController, kRun), 1) << "also after it has left";
}

TEST_F(MembershipTest, ARepeatedAnnouncementIsHeardButChangesNoVersion) {
  note(controller(), 0);
  const auto version = members_.version();
  note(controller(), 400);
  EXPECT_EQ(find()->heard, at(400));
  EXPECT_EQ(members_.version(), version);
  Participant ready = controller();
  ready.ready(true);
  note(ready, 500);
  EXPECT_GT(members_.version(), version);
}

TEST_F(MembershipTest, OneIsSilentAfterMoreThanTwoSeconds) {
  note(controller(), 0);
  EXPECT_FALSE(find()->is_silent(at(2000)));
  EXPECT_TRUE(find()->is_silent(at(2000) + 1ns));
  note(controller(), 2500);
  EXPECT_FALSE(find()->is_silent(at(4500)));
}

TEST_F(MembershipTest, ASecondRepetitionAtAboutTheUsualIntervalCounts) {
  for (const std::int64_t interval : {100, 500, 1000}) {
    SCOPED_TRACE(interval);
    note(controller(0), 0);
    for (int i = 1; i <= 2; ++i) note(controller(), i * interval);
    EXPECT_FALSE(find()->is_repeated);
    note(controller(), 3 * interval);
    EXPECT_TRUE(find()->is_repeated);
    Participant ready = controller();
    ready.ready(true);
    note(ready, 4 * interval);
    EXPECT_FALSE(find()->is_repeated) << "this one is new";
  }
}

TEST_F(MembershipTest, BurstsAndLongPausesAreNoRepetition) {
  for (int i = 0; i < 6; ++i) note(controller(), 99 * i);
  EXPECT_FALSE(find()->is_repeated) << "a burst";
  for (int i = 1; i < 6; ++i) note(controller(), 1000 + 1001 * i);
  EXPECT_FALSE(find()->is_repeated) << "pauses";
}

// Discovery delivers an old announcement long after it was written, and the sender's interval
// counts.
TEST_F(MembershipTest, TheAgeIsTheSmallestOfTheLastFour) {
  for (const std::int64_t age : {3000, 40, 10, 30, 25}) note(controller(), 500, age);
  EXPECT_EQ(find()->age, 10ms);
  for (const std::int64_t age : {35, 45}) note(controller(), 500, age);
  EXPECT_EQ(find()->age, 25ms);
}

TEST_F(MembershipTest, OneIsReadySinceItsFirstReadyAnnouncementOfTheRun) {
  Participant ready = controller();
  ready.ready(true);
  note(ready, 100);
  note(ready, 600);
  EXPECT_EQ(find()->ready_since, at(100));
  note(controller(), 700);
  note(ready, 800);
  EXPECT_EQ(find()->ready_since, at(800)) << "it was not ready in between";
  ready.run_id(kRun + 1);
  note(ready, 900);
  EXPECT_EQ(members_.find(kController, kRun + 1).front().ready_since, at(900));
}

TEST_F(MembershipTest, OthersCannotFillTheMemory) {
  std::set<bus::PeerId> present;
  const auto stranger = [](std::size_t i) {
    return bus::PeerId{{9, static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8)}};
  };
  for (std::size_t i = 0; i <= Membership::kMostMembers; ++i) present.insert(stranger(i));
  members_.set_present(present);
  for (std::size_t i = 0; i <= Membership::kMostMembers; ++i)
    members_.note(controller(), stranger(i), {at(0), {}, 0ns});
  EXPECT_EQ(members_.all().size(), Membership::kMostMembers);
  const auto newcomer = stranger(Membership::kMostMembers);
  present.erase(stranger(3));  // it leaves and makes room
  members_.set_present(present);
  members_.note(controller(), newcomer, {at(1), {}, 0ns});
  EXPECT_EQ(members_.all().size(), Membership::kMostMembers);
  const auto members = members_.all();
  EXPECT_TRUE(std::any_of(members.begin(), members.end(),
                          [&](const Member& member) { return member.peer == newcomer; }));
  Participant last = controller();
  last.done(true);
  members_.note(last, stranger(4), {at(2), {}, 0ns});
  present.erase(stranger(4));
  members_.set_present(present);
  members_.note(controller(), stranger(5), {at(2), {}, 0ns});
  EXPECT_EQ(members_.count_done(kController, kRun), 1) << "one that is known needs no room";
}

}  // namespace
}  // namespace sls::sync
