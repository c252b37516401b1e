/// Shipped scenarios whose error theory knows at each step. config/checks judges every scenario by
/// single figures; tests/python/check/check_shipped_test.py flies these checks.
#include <gtest/gtest.h>

#include <optional>

#include "common/model/reference.hpp"
#include "tests/oracle/linear_theory.hpp"
#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

using Eigen::Array3d;
using Eigen::Vector3d;

/// The record of one vehicle at one step.
struct Step {
  std::size_t stage;
  Vector3d error, v_WL;
  Vector3d seen_error;  ///< error of the measured load
  model::Reference reference;
};

/// One vehicle's flight.
struct Flown {
  explicit Flown(const config::Scenario& alone)
      : scenario(alone),
        gains(control::make_named_gains(alone.controller.own.get<control::QsfKeys>().gains)) {}
  const config::Scenario scenario;  ///< of the vehicle alone
  const control::NamedGains gains;
  std::vector<Step> steps;
  double period() const { return static_cast<double>(scenario.sync.period_ns) * 1e-9; }
};

std::vector<Flown> read_flights(const std::string& scenario_file,
                                const std::filesystem::path& recording) {
  const config::Scenario scenario = config::load_scenario(scenario_file);
  std::vector<Flown> flights;
  for (std::uint32_t id = 0; id < scenario.vehicles.size(); ++id)
    flights.emplace_back(config::make_vehicle_scenario(scenario, id));
  const Table states(recording / "state.csv"), references(recording / "reference.csv");
  EXPECT_EQ(states.rows(), references.rows());
  std::optional<Table> measured;
  if (std::filesystem::exists(recording / "measured.csv")) {
    measured.emplace(recording / "measured.csv");
    EXPECT_EQ(measured->rows(), states.rows());
  }
  for (std::size_t row = 0; row < states.rows(); ++row) {
    for (const char* column : {"vehicle_id", "step"})
      EXPECT_EQ(states.text(row, column), references.text(row, column)) << row;
    const auto read = [&](const Table& table, const char* x, const char* y, const char* z) {
      return Vector3d(table.number(row, x), table.number(row, y), table.number(row, z));
    };
    Step step;
    step.stage = std::stoul(references.text(row, "stage"));
    step.v_WL = read(states, "load_vx_m_s", "load_vy_m_s", "load_vz_m_s");
    model::Reference& reference = step.reference;
    reference.position = references.position(row, "ref");
    reference.velocity = read(references, "ref_vx_m_s", "ref_vy_m_s", "ref_vz_m_s");
    reference.acceleration = read(references, "ref_ax_m_s2", "ref_ay_m_s2", "ref_az_m_s2");
    reference.jerk = read(references, "ref_jx_m_s3", "ref_jy_m_s3", "ref_jz_m_s3");
    step.error = states.position(row, "load") - reference.position;
    step.seen_error = measured ? measured->position(row, "load") - reference.position : step.error;
    flights.at(std::stoul(states.text(row, "vehicle_id"))).steps.push_back(step);
  }
  return flights;
}

/// If the vertical reference jumps, the load's acceleration and jerk also jump: s = g − n₃ changes,
/// but the rod's slope w and its rate do not (the law's eq. (5)).
void jump(const Flown& flown, const Step& start, Vector3d& acceleration, Vector3d& jerk) {
  const control::AxisGains& z = flown.gains.vertical;
  const double g = flown.scenario.vehicle.gravity, s_before = g - acceleration.z();
  const Eigen::Vector2d w = -acceleration.head<2>() / s_before;
  const Eigen::Vector2d w_dot = (jerk.z() * w - jerk.head<2>()) / s_before;
  const double e_dot = start.v_WL.z() - start.reference.velocity.z();
  const double n3 =
      start.reference.acceleration.z() - z.velocity * e_dot - z.position * start.error.z();
  const double n3_dot = start.reference.jerk.z() -
                        z.velocity * (n3 - start.reference.acceleration.z()) - z.position * e_dot;
  acceleration << -(g - n3) * w, n3;
  jerk << n3_dot * w - (g - n3) * w_dot, n3_dot;
}

/// If the controller's model is correct, the load's error follows the designed linear equations,
/// for small and large motions. Only the hold adds a deviation.
void expect_designed_response(const Flown& flown) {
  const auto& [xy, z] = flown.gains;
  const std::vector<Step>& steps = flown.steps;
  std::size_t last = 0;
  for (std::size_t first = 0; first < steps.size(); first = last) {
    while (last < steps.size() && steps[last].stage == steps[first].stage) ++last;
    const Step& start = steps[first];
    // The load begins a stage with the motion of the previous reference, the first one at rest.
    Vector3d acceleration(0, 0, 0), jerk(0, 0, 0);
    if (first > 0) {
      acceleration = steps[first - 1].reference.acceleration;
      jerk = steps[first - 1].reference.jerk;
    }
    jump(flown, start, acceleration, jerk);
    const Vector3d e_dot = start.v_WL - start.reference.velocity;
    double speed = 0.0;
    for (std::size_t i = first; i < last; ++i) speed = std::max(speed, steps[i].v_WL.norm());
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector4d x(start.error[axis], e_dot[axis],
                              acceleration[axis] - start.reference.acceleration[axis],
                              jerk[axis] - start.reference.jerk[axis]);
      const auto designed =
          axis < 2 ? oracle::calc_designed_error(
                         Eigen::RowVector4d(xy.position, xy.velocity, xy.acceleration, xy.jerk), x,
                         flown.period(), last - first)
                   : oracle::calc_designed_error(Eigen::RowVector2d(z.position, z.velocity),
                                                 x.head<2>(), flown.period(), last - first);
      double deviation = 0.0;
      for (std::size_t i = first; i < last; ++i)
        deviation = std::max(deviation, std::abs(steps[i].error[axis] - designed[i - first]));
      // The hold delays force and load by half a period on average: the deviation is half a period
      // times the speed. A fifth more allows for overshoot.
      EXPECT_LE(deviation, 0.6 * flown.period() * speed)
          << "stage " << start.stage << ", axis " << axis;
    }
  }
}

const config::FigureEightReference& find_eight(const Flown& flown) {
  for (const config::Stage& stage : flown.scenario.mission)
    if (const auto* eight = std::get_if<config::FigureEightReference>(&stage.reference))
      return *eight;
  throw std::runtime_error("no figure eight");
}

Array3d calc_second_lap_rms(const Flown& flown, Vector3d Step::*of = &Step::error) {
  const auto lap =
      static_cast<std::size_t>(std::llround(find_eight(flown).period_s / flown.period()));
  std::size_t first = 0;
  while (flown.scenario.mission.at(flown.steps.at(first).stage).kind != "figure_eight") ++first;
  Array3d squares = Array3d::Zero();
  for (std::size_t i = first + lap; i < first + 2 * lap; ++i)
    squares += (flown.steps.at(i).*of).array().square();
  return (squares / static_cast<double>(lap)).sqrt();
}

/// Linear theory neglects terms of second order in the rod's slope, which is at most 0.05 on the
/// figure eight. Horizontally they are 0.25 %, and the remaining transient of the first lap is as
/// large. In height they are added to an error a hundred times smaller: 4 %.
void expect_steady_error(const Flown& flown, double tolerance_z = 0.05,
                         double tolerance_xy = 0.005) {
  const Array3d rms = calc_second_lap_rms(flown);
  const Array3d expected = oracle::calc_steady_error(flown.scenario, find_eight(flown)).rms();
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(rms[axis], expected[axis], (axis < 2 ? tolerance_xy : tolerance_z) * expected[axis])
        << "axis " << axis;
}

void expect_eight(const Flown& flown) {
  expect_designed_response(flown);
  expect_steady_error(flown);
}

/// With the mass M′ of the controller's model, the height error is the solution of
/// e⁽³⁾ = −(M′/M) (k_v ë + k_p ė + k_i e). It starts with
/// ë = −(M′/M) (k_v ė + k_p e) − (M′ − M) g / M.
void expect_height_of_wrong_mass(const Flown& flown) {
  const model::SlungLoadParameters& truth = flown.scenario.vehicle;
  const double ratio = flown.scenario.controller.model.vehicle.total_mass() / truth.total_mass();
  const control::AxisGains& z = flown.gains.vertical;
  const double e = flown.steps.at(0).error.z();
  const auto expected = oracle::calc_designed_error(
      ratio * Eigen::RowVector3d(z.integral, z.position, z.velocity),
      Vector3d(e, 0.0, -ratio * z.position * e - (ratio - 1.0) * truth.gravity), flown.period(),
      flown.steps.size());
  // While the load swings, the wrong tension disturbs the height. After 20 s the load hangs still;
  // the height, which the hold delays, then moves at 2.5e-4 m/s at most.
  for (std::size_t i = 5000; i < expected.size(); ++i)
    ASSERT_NEAR(flown.steps[i].error.z(), expected[i], 0.5 * flown.period() * 2.5e-4) << i;
}

/// The theory assumes continuous time; its error at 50 Hz is 1 %.
void expect_hold_of_20_ms(const Flown& flown) {
  expect_designed_response(flown);
  expect_steady_error(flown, 0.05, 0.015);
}

/// Expects the steady errors of the true load and of the measured load.
void expect_error_of_late_states(const Flown& flown) {
  const oracle::SteadyError expected = oracle::calc_steady_error(flown.scenario, find_eight(flown));
  const Array3d rms = calc_second_lap_rms(flown);
  const Array3d seen = calc_second_lap_rms(flown, &Step::seen_error);
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(rms[axis], expected.rms()[axis], 0.01 * expected.rms()[axis]) << "axis " << axis;
  // The measurement stays constant for a sample period. This adds a sawtooth about the mean, as
  // high as the motion in one sample period.
  const config::FigureEightReference& eight = find_eight(flown);
  for (int axis = 0; axis < 3; ++axis) {
    const double w = 2.0 * M_PI * (axis == 1 ? 2 : 1) / eight.period_s;
    const double sawtooth = w * eight.amplitude[axis] / std::sqrt(2.0) * 1e-9 *
                            static_cast<double>(flown.scenario.sensing.body.period_ns) /
                            std::sqrt(12.0);
    const double expected_seen = std::hypot(expected.seen_rms()[axis], sawtooth);
    EXPECT_NEAR(seen[axis], expected_seen, 0.02 * expected_seen) << "axis " << axis;
  }
}

const std::map<std::string, void (*)(const Flown&)> kJudges = {
    {"figure_eight", expect_eight},
    {"fleet", expect_designed_response},
    {"gazebo_corrected", expect_eight},
    {"integral_mass_error", expect_height_of_wrong_mass},
    {"mass_error_without_integral", expect_height_of_wrong_mass},
    {"matlab_figure_eight", expect_eight},
    {"matlab_setpoint_1", expect_designed_response},
    {"matlab_setpoint_2", expect_designed_response},
    {"matlab_setpoint_3", expect_designed_response},
    {"mission", expect_eight},
    {"px4_hold", expect_hold_of_20_ms},
    {"px4_ideal", expect_eight},
    {"px4_offset", expect_eight},
    {"px4_stale", expect_error_of_late_states},
    {"rest_to_rest", expect_designed_response},
    {"rigid_figure_eight", expect_eight},
    {"rotor_drag", expect_eight},
    {"setpoints", expect_designed_response},
    {"short", expect_designed_response},
};

class ShippedScenarioTest : public ::testing::TestWithParam<std::string> {};

TEST_P(ShippedScenarioTest, FliesAsTheorySaysAtEachStep) {
  const std::string file = scenario(GetParam());
  const TemporaryFolder folder;
  const std::vector<Flown> flights = read_flights(file, fly_in_process(file, folder / "recording"));
  for (std::size_t id = 0; id < flights.size(); ++id) {
    SCOPED_TRACE("vehicle " + std::to_string(id));
    ASSERT_FALSE(flights[id].steps.empty());
    kJudges.at(GetParam())(flights[id]);
  }
}

std::vector<std::string> list_judged() {
  std::vector<std::string> names;
  for (const auto& [name, judge] : kJudges) names.push_back(name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(All, ShippedScenarioTest, ::testing::ValuesIn(list_judged()),
                         [](const auto& instance) { return instance.param; });

}  // namespace
}  // namespace sls::test
