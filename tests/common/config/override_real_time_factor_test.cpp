#include <gtest/gtest.h>

#include <cmath>

#include "tests/common/config/support.hpp"

namespace sls::config::test {
namespace {

std::string find_override_error(SyncMode mode, double factor) {
  Scenario scenario = parse_scenario(kMinimalScenario, "file");
  scenario.sync.mode = mode;
  try {
    override_real_time_factor(scenario, factor);
  } catch (const ConfigError& error) {
    EXPECT_EQ(scenario.sync.real_time_factor, 1.0) << "changed in spite of the error";
    return error.what();
  }
  EXPECT_EQ(scenario.sync.real_time_factor, factor);
  return "no error";
}

TEST(OverrideRealTimeFactorTest, AcceptsTheValuesOfTheKey) {
  EXPECT_EQ(find_override_error(SyncMode::kRealtime, 0.5), "no error");
  EXPECT_EQ(find_override_error(SyncMode::kRealtime, 1000.0), "no error");
  for (const double factor : {0.0, -1.0, 1000.1, std::nan("")})
    EXPECT_EQ(find_override_error(SyncMode::kRealtime, factor)
                  .rfind("--rtf: expected from 0.001 to 1000, got ", 0),
              0u);
}

TEST(OverrideRealTimeFactorTest, LockstepHasNone) {
  EXPECT_EQ(find_override_error(SyncMode::kLockstep, 2.0),
            "--rtf: expected --mode realtime with it, got lockstep");
}

}  // namespace
}  // namespace sls::config::test
