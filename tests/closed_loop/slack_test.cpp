// The law `qsf` on cables that go slack: drops, a kick and a cut, each also without the rule.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

#include "closed_loop/flight.hpp"
#include "control_client/laws/qsf/lqr.hpp"
#include "control_client/laws/qsf/slack.hpp"
#include "sim_server/plants/cables/keys.hpp"
#include "tests/closed_loop/support.hpp"

namespace sls::closed_loop::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using model::SharedLoad;

constexpr double kGravity = 9.8, kQuad = 1.5, kLoad = 0.2;    // of the scenarios
constexpr double kReduced = kQuad * kLoad / (kQuad + kLoad);  // kg
const double kMostForce = std::sqrt(5.0) * kQuad * kGravity;  // N, README.md of qsf, eq. (16)

config::Scenario with_rate(config::Scenario scenario, std::optional<double> rate) {
  scenario.controller.own.edit<control::QsfKeys>().retaut_rate = rate;
  return scenario;
}

struct Flown {
  std::vector<model::StepRecord> steps;
  std::vector<std::string> remarks;
  std::string failure;

  bool is_taut(std::size_t k) const { return steps[k].truth.signals[SharedLoad::kTaut] == 1.0; }
  std::size_t find(bool is_taut_wanted, std::size_t from = 0) const {
    while (from < steps.size() && is_taut(from) != is_taut_wanted) ++from;
    return from;
  }
  /// How fast the ends parted when the cable became taut, m/s, by its impulse.
  std::vector<double> rates() const {
    std::vector<double> found;
    for (const std::string& remark : remarks)
      if (const auto at = remark.find("impulse "); at != std::string::npos)
        found.push_back(std::atof(remark.c_str() + at + 8) / kReduced);
    return found;
  }
};

Flown fly_with_remarks(const config::Scenario& scenario) {
  Flight flight(scenario);
  Flown flown;
  while (const model::StepRecord* step = flight.fly_step()) {
    flown.steps.push_back(*step);
    for (const std::string& remark : flight.take_remarks()) flown.remarks.push_back(remark);
  }
  flown.failure = flight.failure();
  return flown;
}

TEST(SlackCableTest, ADropIsCaughtAtTheRateOfTheRuleAndTheErrorThenFallsAsDesigned) {
  const config::Scenario scenario = load("slack_drop");
  const Flown plain = fly_with_remarks(with_rate(scenario, {}));
  ASSERT_EQ(plain.rates().size(), 1u);
  // A vehicle that holds its height would catch it at the speed of a fall of 0.6 m.
  EXPECT_GT(plain.rates()[0], std::sqrt(2.0 * kGravity * 0.6));

  for (const double rate : {1.0, 2.0, 3.0}) {
    SCOPED_TRACE(rate);
    const Flown flown = fly_with_remarks(with_rate(scenario, rate));
    EXPECT_EQ(flown.failure, "");
    ASSERT_EQ(flown.rates().size(), 1u) << "taut once, and it stays so";
    EXPECT_LE(flown.rates()[0], rate + 1e-5);  // six digits in the remark
    EXPECT_GT(flown.rates()[0], 0.85 * rate);
    const std::size_t caught = flown.find(true);
    for (std::size_t k = 0; k < caught; ++k) {
      const Vector3d& force = flown.steps[k].answer.f_Q_W;
      ASSERT_LE(force.norm(), kMostForce * (1.0 + 1e-12)) << k;
      ASSERT_LE(force.z(), 0.0) << k;
      const double t = static_cast<double>(k) * 0.004;
      ASSERT_NEAR(flown.steps[k].truth.p_WL.z(), -1.5 + 0.5 * kGravity * t * t, 1e-9) << k;
    }
    // From then on e follows its designed equation; the force acts 2 ms late in the mean.
    const control::AxisGains gains = control::make_named_gains(control::LqrWeights{10, 5}).vertical;
    Eigen::Matrix2d A;
    A << 0.0, 1.0, -gains.position, -gains.velocity;
    const auto error = [&](std::size_t k) {
      const model::SlungLoadState& at = flown.steps[k].truth;
      return Vector2d(at.p_WL.z() + 0.9, at.v_WL.z());
    };
    double largest = 0.0, deviation = 0.0;
    for (std::size_t k = caught; k < flown.steps.size(); ++k) {
      const double t = static_cast<double>(k - caught) * 0.004;
      const Vector2d designed = (A * t).exp() * error(caught);
      largest = std::max(largest, std::abs(designed[0]));
      deviation = std::max(deviation, std::abs(designed[0] - error(k)[0]));
    }
    EXPECT_LE(deviation, 0.01 * largest);
    EXPECT_LE(error(flown.steps.size() - 1).norm(), 1e-3);
  }
}

TEST(SlackCableTest, AFlungLoadPassesBesideTheVehicleAndIsCaught) {
  const config::Scenario scenario = load("aggressive_slack");
  const Flown plain = fly_with_remarks(with_rate(scenario, {}));
  EXPECT_EQ(plain.steps.size(), 1u);
  EXPECT_NE(plain.failure.find("free_fall"), std::string::npos) << plain.failure;

  const Flown flown = fly_with_remarks(scenario);
  EXPECT_EQ(flown.failure, "");
  const std::size_t slack = flown.find(false), caught = flown.find(true, slack);
  ASSERT_LT(caught, flown.steps.size());
  EXPECT_LT(flown.steps[slack].truth.p_WL.z(), flown.steps[slack].truth.p_WQ.z()) << "above";
  EXPECT_GT(flown.steps[caught].truth.p_WL.z(), flown.steps[caught].truth.p_WQ.z()) << "below";
  const auto energy = [&](std::size_t k) {  // per mass of the load
    const model::SlungLoadState& at = flown.steps[k].truth;
    return 0.5 * at.v_WL.squaredNorm() - kGravity * at.p_WL.z();
  };
  for (std::size_t k = slack; k < caught; ++k) {
    ASSERT_FALSE(flown.is_taut(k)) << k;
    ASSERT_NEAR(energy(k), energy(slack), 1e-9) << k;
    ASSERT_LE(flown.steps[k].answer.f_Q_W.norm(), kMostForce * (1.0 + 1e-12)) << k;
    const model::SlungLoadState& at = flown.steps[k].truth;
    ASSERT_GT((at.p_WL - at.p_WQ).norm(), 0.3) << k;
  }
  EXPECT_EQ(flown.find(false, caught), flown.steps.size()) << "taut for good";
  const model::StepRecord& last = flown.steps.back();
  EXPECT_LE((last.truth.p_WL - last.answer.reference.position).norm(), 1e-3);
}

TEST(SlackCableTest, AVehicleWithoutALoadHoldsItsReference) {
  config::Scenario scenario = load("pick_up_and_set_down");
  const auto find_height_error = [](const Flown& flown) {
    const model::StepRecord& last = flown.steps.back();
    EXPECT_LE((last.truth.p_WQ - last.answer.reference.position).head<2>().norm(), 0.1);
    return last.truth.p_WQ.z() + 1.0 - last.answer.reference.position.z();
  };
  const control::AxisGains gains = control::make_named_gains(control::LqrWeights{10, 5}).vertical;
  const double climb = kLoad * kGravity / (kQuad + kLoad) / gains.position;
  EXPECT_NEAR(find_height_error(fly_with_remarks(scenario)), -climb, 0.01) << "without the rule";
  EXPECT_NEAR(find_height_error(fly_with_remarks(with_rate(scenario, 1.0))), 0.0, 1e-3);
}

TEST(SlackCableTest, WithoutCablesTheRuleChangesNoBit) {
  for (const char* name : {"short", "multirotor_figure_eight"}) {
    config::Scenario scenario = load(name);
    scenario.mission[0].leave = config::LeaveAfter{2'000'000'000};
    const auto plain = fly(scenario), flown = fly(with_rate(scenario, 2.0));
    ASSERT_EQ(plain.size(), flown.size());
    for (std::size_t k = 0; k < plain.size(); ++k) {
      ASSERT_EQ(plain[k].answer.f_Q_W, flown[k].answer.f_Q_W) << name << k;
      ASSERT_EQ(plain[k].truth.p_WL, flown[k].truth.p_WL) << name << k;
    }
  }
}

TEST(SlackCableTest, TheForceIsBoundedAndNeverDownwards) {
  const model::SlungLoadParameters vehicle{kQuad, kLoad, 1.0, kGravity};
  const control::SlackRule rule(vehicle, {1.0, 2.0, 0.0, 0.0, 0.0}, 2.0, 0.004, {});
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  const auto vector = [&](double size) -> Vector3d {
    return size * Vector3d(any(random), any(random), any(random));
  };
  for (int i = 0; i < 10'000; ++i) {
    model::Measurement seen;
    seen.p_WQ = vector(3.0);
    seen.p_WL = i % 10 == 0 ? seen.p_WQ : Vector3d(seen.p_WQ + vector(i % 3 == 0 ? 1e-9 : 1.0));
    seen.v_WQ = vector(10.0);
    seen.v_WL = vector(10.0);
    seen.signals.setZero(SharedLoad::kSignals);
    model::Reference reference;
    reference.position = vector(5.0);
    reference.acceleration = vector(30.0);
    const Vector3d force = rule.calc_force(seen, reference);
    ASSERT_LE(force.norm(), kMostForce * (1.0 + 1e-12)) << i;
    ASSERT_LE(force.z(), 0.0) << i;
  }
}

TEST(SlackCableTest, ASampleWithoutSignalsIsAnError) {
  const control::FlightController controller(with_rate(load("slack_drop"), 2.0));
  EXPECT_EQ(controller.calc_answer(0, {}, {}).error_code, control::ErrorCode::kNotFinite);
}

TEST(SlackCableTest, FurtherSignalsAreWhereTheLoadSaysWhateverThePlantHas) {
  for (int has = 0; has < 8; ++has) {
    config::Scenario scenario = load("slack_drop");
    std::string text = "plant:\n  model: cables\n  initial: { load_position_m: [0, 0, -1.5] }\n";
    if (has & 1) text += "  ground_z_m: 0\n";
    text += "  cables: [{ distance_m: 0.9";
    if (has & 2) text += ", release_s: 1";
    if (has & 4)
      text +=
          ", winch: { min_length_m: 0.5, max_length_m: 2, stages: [{ at_s: 1, length_m: 2, "
          "rate_m_s: 1, acceleration_m_s2: 1 }] }";
    text += " }]\n";
    const std::size_t from = scenario.text.find("plant:"), to = scenario.text.find("sync:");
    scenario = config::parse_scenario(
        scenario.text.substr(0, from) + text + scenario.text.substr(to), "file");
    const Flight flight(scenario);
    const std::vector<sim::Signal> signals = flight.plant().signals();
    const SharedLoad& load = scenario.shared_load.value();
    ASSERT_EQ(load.on_ground.has_value(), (has & 1) != 0);
    ASSERT_EQ(load.released.has_value(), (has & 2) != 0);
    if (load.on_ground) {
      EXPECT_EQ(signals.at(*load.on_ground).name, "load_on_ground");
    }
    if (load.released) {
      EXPECT_EQ(signals.at(*load.released).name, "cable_released");
    }
  }
}

}  // namespace
}  // namespace sls::closed_loop::test
