#include "common/bus/names.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

namespace sls::bus {
namespace {

/// Expects a different word for every value, and "unknown" after the last one.
template <class Enum>
void expect_words(const std::vector<Enum>& values) {
  std::set<std::string> words;
  for (const Enum value : values) words.insert(to_string(value));
  EXPECT_EQ(words.size(), values.size());
  EXPECT_EQ(words.count(""), 0u);
  EXPECT_EQ(words.count("unknown"), 0u);
  EXPECT_STREQ(to_string(static_cast<Enum>(values.size())), "unknown");
}

TEST(NamesTest, EveryRunPhaseHasAWord) {
  expect_words<RunPhase>({RunPhase::PHASE_WAITING, RunPhase::PHASE_RUNNING, RunPhase::PHASE_PAUSED,
                          RunPhase::PHASE_FINISHED, RunPhase::PHASE_FAILED, RunPhase::PHASE_RESET});
}

TEST(NamesTest, EveryModeHasAWord) {
  expect_words<SyncMode>({SyncMode::MODE_LOCKSTEP, SyncMode::MODE_REALTIME});
}

TEST(NamesTest, EveryRoleHasAWord) {
  expect_words<ParticipantRole>({ParticipantRole::ROLE_CONTROLLER, ParticipantRole::ROLE_RECORDER});
}

}  // namespace
}  // namespace sls::bus
