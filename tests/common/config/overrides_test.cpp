#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/common/config/support.hpp"
#include "tests/support/errors.hpp"

namespace sls::config::test {
namespace {

/// 4 ms period, 1 ms step, one stage of 2 s.
Scenario make_scenario() { return parse_scenario(kMinimalScenario, "file"); }

std::string find_override_error(double period_s, const Scenario& before = make_scenario()) {
  Scenario scenario = before;
  const std::string error =
      sls::test::find_error<ConfigError>([&] { override_period(scenario, period_s); });
  EXPECT_TRUE(error == "no error" || are_equal(scenario, before))
      << "changed in spite of " << error;
  return error;
}

TEST(OverridePeriodTest, LongerPeriodKeepsTheStep) {
  Scenario scenario = make_scenario();
  override_period(scenario, 0.008);
  EXPECT_EQ(scenario.sync.period_ns, 8'000'000);
  EXPECT_EQ(scenario.plant.step_ns, 1'000'000);
}

TEST(OverridePeriodTest, PeriodBelowTheStepBecomesTheStep) {
  Scenario scenario = make_scenario();
  override_period(scenario, 0.0005);
  EXPECT_EQ(scenario.sync.period_ns, 500'000);
  EXPECT_EQ(scenario.plant.step_ns, 500'000);
}

TEST(OverridePeriodTest, ChangesNothingElse) {
  Scenario scenario = make_scenario();
  override_period(scenario, 0.001);
  EXPECT_EQ(scenario.text, make_scenario().text);
  EXPECT_EQ(scenario.sha256, make_scenario().sha256);
  scenario.sync.period_ns = 4'000'000;
  EXPECT_TRUE(are_equal(scenario, make_scenario()));
}

TEST(OverridePeriodTest, ImpossiblePeriodsNameTheFlag) {
  EXPECT_EQ(find_override_error(0.0), "--period-s: expected > 0, got 0");
  EXPECT_EQ(find_override_error(-0.004), "--period-s: expected > 0, got -0.004");
  EXPECT_EQ(find_override_error(1e-10),
            "--period-s: expected a whole number of nanoseconds, got 1.0e-10");
  EXPECT_EQ(find_override_error(1e9), "--period-s: expected at most 1000000 s, got 1000000000");
  EXPECT_EQ(find_override_error(std::numeric_limits<double>::quiet_NaN()),
            "--period-s: expected > 0, got nan");
  EXPECT_EQ(find_override_error(std::numeric_limits<double>::infinity()),
            "--period-s: expected at most 1000000 s, got inf");
}

TEST(OverridePeriodTest, PeriodMustFitStepAndStages) {
  EXPECT_EQ(find_override_error(0.0025),
            "--period-s: expected a multiple of plant.step_s (0.001), got 0.0025");
  EXPECT_EQ(find_override_error(0.003),
            "--period-s: expected a divisor of mission[0].for_s (2), got 0.003");
}

TEST(OverridePeriodTest, PeriodMustFitTheDelaysOfFaults) {
  const auto find_error_at = [](const std::string& by_s, double period_s) {
    const std::string faults =
        "faults:\n  - freeze: { on: state }\n  - delay: { on: state, by_s: " + by_s + " }\n";
    return find_override_error(period_s, parse_scenario(kMinimalScenario + faults, "file"));
  };
  EXPECT_EQ(find_error_at("0.02", 0.002), "no error");
  EXPECT_EQ(find_error_at("0.02", 0.008),
            "--period-s: expected a divisor of faults[1].delay.by_s (0.02), got 0.008");
  // A delay of 200 s is 50,000 periods of 4 ms, but 200,000 of 1 ms.
  EXPECT_EQ(find_error_at("200", 0.001),
            "--period-s: faults[1].delay.by_s: expected delays of one channel of at most 100000 "
            "periods (100 s), got 200");
}

TEST(OverridePeriodTest, AShorterStepMustNotMeanTooManySamplesUnderWay) {
  Scenario scenario = parse_scenario(
      std::string(kMinimalScenario) + "sensing: { period_s: 0.01, age_s: 1.5 }\n", "file");
  override_period(scenario, 0.00001);  // samples stay 10 ms apart
  EXPECT_EQ(scenario.plant.step_ns, 10'000);
  scenario.sensing.node_delay_ns = 1'500'000'000;
  EXPECT_EQ(find_override_error(0.00001, scenario),
            "--period-s: sensing.node_delay_s: expected at most 100000 samples of 0.00001 s under "
            "way, got 1.5");
}

TEST(OverridePeriodTest, TheStepInForceMustFitThePeriodOfTheAutopilot) {
  const auto find_error_at = [](const char* autopilot, double period_s) {
    return find_override_error(period_s, parse_scenario(make_autopilot_text(autopilot), "file"));
  };
  EXPECT_EQ(find_error_at("{ model: px4, period_s: 0.003 }", 0.02), "no error");  // the step stays
  EXPECT_EQ(find_error_at("{ model: px4, period_s: 0.003 }", 0.0005), "no error");
  EXPECT_EQ(find_error_at("{ model: px4, period_s: 0.003 }", 0.0008),
            "--period-s: expected a divisor of autopilot.period_s (0.003), got 0.0008");
  EXPECT_EQ(find_error_at("{ model: none }", 0.0008), "no error");
}

std::string find_factor_error(SyncMode mode, double factor) {
  Scenario scenario = parse_scenario(kMinimalScenario, "file");
  scenario.sync.mode = mode;
  const std::string error =
      sls::test::find_error<ConfigError>([&] { override_real_time_factor(scenario, factor); });
  EXPECT_EQ(scenario.sync.real_time_factor, error == "no error" ? factor : 1.0) << error;
  return error;
}

TEST(OverrideRealTimeFactorTest, AcceptsTheValuesOfTheKey) {
  EXPECT_EQ(find_factor_error(SyncMode::kRealtime, 0.5), "no error");
  EXPECT_EQ(find_factor_error(SyncMode::kRealtime, 1000.0), "no error");
  for (const double factor : {0.0, -1.0, 1000.1, std::nan("")})
    EXPECT_EQ(find_factor_error(SyncMode::kRealtime, factor)
                  .rfind("--rtf: expected from 0.001 to 1000, got ", 0),
              0u);
}

TEST(OverrideRealTimeFactorTest, LockstepHasNone) {
  EXPECT_EQ(find_factor_error(SyncMode::kLockstep, 2.0),
            "--rtf: expected --mode realtime with it, got lockstep");
}

}  // namespace
}  // namespace sls::config::test
