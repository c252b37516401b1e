/// Real time at 250 Hz for a minute. `./sls test --slow`, on an idle machine.
#include <gtest/gtest.h>

#include <regex>
#include <thread>

#include "closed_loop/flight.hpp"
#include "tests/system/flight.hpp"
#include "tests/system/load.hpp"

namespace sls::test {
namespace {

/// The figure eight for 60 s at a real-time factor of 1.
class RealTimeMinuteTest : public ::testing::Test {
 protected:
  std::string make_minute() const {
    return make_scenario(folder_, {{"for_s: 32", "for_s: 60"}}, "figure_eight");
  }
  /// Numbers of the timing label. The label must not begin with "degraded".
  struct Timing {
    int late = -1;
    double worst_age_ms = 0.0;
  };
  static Timing read_timing(const Flight& flight) {
    const std::string label = read_manifest(flight.recording()).at("timing");
    std::printf("%s\n", label.c_str());
    const std::regex form(
        "real-time, (\\d+) of 15000 late, worst age (\\S+) ms, states at most \\S+ ms late");
    std::smatch words;
    if (std::regex_match(label, words, form)) return {std::stoi(words[1]), std::stod(words[2])};
    ADD_FAILURE() << label;
    return {};
  }
  /// From the second lap on, in m. Every force of the flight is `delay_ms` late.
  static double calc_largest_error(const std::string& file, double delay_ms) {
    config::Scenario scenario = config::load_scenario(file);
    config::Fault fault;
    fault.on = config::FaultChannel::kCommand;
    fault.effect = config::DelayFault{std::llround(delay_ms * 1e6)};
    scenario.faults = {fault};
    double largest = 0.0;
    for (const model::StepRecord& step : closed_loop::fly(scenario))
      if (step.step >= 4000)
        largest = std::max(
            largest, (step.truth.p_WL - step.answer.reference.position).cwiseAbs().maxCoeff());
    return largest;
  }
  TemporaryFolder folder_;
};

TEST_F(RealTimeMinuteTest, NoAnswerIsLateOnAnIdleMachine) {
  Flight flight(make_minute(), {{}, {"--mode", "realtime"}, {}});
  flight.expect_success();
  const Timing timing = read_timing(flight);
  EXPECT_EQ(timing.late, 0);
  EXPECT_EQ(timing.worst_age_ms, 0.0);
}

TEST_F(RealTimeMinuteTest, WithEveryCoreBusyTheLoadErrsNoMoreThanTheLabelExplains) {
  const std::string file = make_minute();
  const Load load(std::thread::hardware_concurrency());
  Flight flight(file, {{}, {"--mode", "realtime"}, {}});
  flight.expect_success();
  const Timing timing = read_timing(flight);
  const double error = calc_tracking_error(flight.recording(), 4000, 15000).max.maxCoeff();
  const double undisturbed = calc_largest_error(file, 0.0);
  const double delayed = calc_largest_error(file, timing.worst_age_ms);
  // Assumes that every late force had the age of the oldest, and that all late steps are in the 2 s
  // over which the loop averages (its slowest pole is −0.5 1/s). Factor 2, because the loop does
  // not weight all steps equally.
  const double share = std::min(1.0, 0.004 * timing.late / 2.0);
  const double bound = undisturbed + 2.0 * share * (delayed - undisturbed);
  std::printf("largest load position error from the second lap on: %.3g m, bound %.3g m\n", error,
              bound);
  EXPECT_LE(error, bound);
}

}  // namespace
}  // namespace sls::test
