#include "control_client/laws/pid/pid_law.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <limits>

#include "tests/control_client/oracle_flight.hpp"
#include "tests/control_client/sample_scenarios.hpp"

namespace sls::control {
namespace {

using Eigen::Vector3d;

config::Scenario fly_with_pid(config::Scenario scenario) {
  scenario.controller.law.name = "pid";
  scenario.controller.own = PidKeys{};
  return scenario;
}

LawInput make_hover_input(const Vector3d& p_WL) {
  LawInput input;
  static_cast<model::SlungLoadState&>(input.state) =
      model::make_state(p_WL - Vector3d::UnitZ(), Vector3d::Zero(), model::RodAngles{}, 1.0);
  input.memory = Vector3d::Zero();
  return input;
}

TEST(PidLawTest, HoldsTheWeightAtRestOnItsReference) {
  const model::SlungLoadParameters vehicle;
  const PidLaw law(vehicle, PidGains{}, 0.004);
  LawInput input = make_hover_input({1.0, 2.0, -3.0});
  input.reference.position << 1.0, 2.0, -3.0;
  const LawOutput output = law.calc(input);
  EXPECT_EQ(output.error_code, ErrorCode::kNone);
  EXPECT_LE((output.f_Q_W - Vector3d(0, 0, -vehicle.total_mass() * vehicle.gravity)).norm(), 1e-13);
  EXPECT_EQ(output.memory, Vector3d::Zero());
}

/// System matrix of the oracle under the law's force near hover, for one horizontal axis. The state
/// is (load position, velocity, rod slope, its rate).
Eigen::Matrix4d calc_linearised_loop(const PidLaw& law, const model::SlungLoadParameters& vehicle) {
  const double d = 1e-6;
  Eigen::Matrix4d A;
  for (int column = 0; column < 4; ++column) {
    Eigen::Vector4d rates[2];
    for (const int side : {0, 1}) {
      Eigen::Vector4d x = Eigen::Vector4d::Zero();
      x[column] = side == 0 ? d : -d;
      const Vector3d n_W = Vector3d(x[2], 0.0, 1.0).normalized();
      const oracle::State state{Vector3d(x[0], 0, 0) - vehicle.rod_length * n_W,
                                Vector3d(x[1] - vehicle.rod_length * x[3], 0, 0), n_W,
                                Vector3d(x[3], 0, 0) - n_W * n_W.x() * x[3]};
      LawInput input;
      static_cast<model::SlungLoadState&>(input.state) =
          oracle::to_model_state(state, vehicle.rod_length);
      input.memory = Vector3d::Zero();
      const auto a = oracle::calc_accelerations(state, law.calc(input).f_Q_W, vehicle);
      rates[side] << x[1], a.a_WL.x(), x[3], (a.a_WL.x() - a.a_WQ.x()) / vehicle.rod_length;
    }
    A.col(column) = (rates[0] - rates[1]) / (2 * d);
  }
  return A;
}

TEST(PidLawTest, ClosesTheLoopThatItsGainsSay) {
  // Eqs. (2) to (5) near hover: ÿ = −g w, ẅ = −k_a (w − w*) − k_r ẇ, w* = k_v (k_p y + ẏ) / g.
  // Its characteristic polynomial: s⁴ + k_r s³ + k_a s² + k_a k_v s + k_a k_v k_p.
  const model::SlungLoadParameters vehicle;
  PidGains gains;
  gains.horizontal = {0.6, 1.5, 0.0, 36.0, 12.0};
  const PidLaw law(vehicle, gains, 0.004);
  const Eigen::Matrix4d A = calc_linearised_loop(law, vehicle);
  for (const auto& s : A.eigenvalues()) {
    EXPECT_LT(s.real(), 0.0);
    const auto value =
        s * s * s * s + 12.0 * s * s * s + 36.0 * s * s + 36.0 * 1.5 * s + 36.0 * 1.5 * 0.6;
    EXPECT_LE(std::abs(value), 1e-3 * 36.0 * 1.5);  // central differences with step 1e-6
  }
}

TEST(PidLawTest, ReachesASetPointAndRemovesAConstantDisturbance) {
  config::Scenario scenario = fly_with_pid(make_figure_eight(4'000'000));
  scenario.plant.disturbance_W << 0.3, -0.2, 0.4;
  scenario.mission = {make_hold({0.5, -0.5, -1.0}, 90 * kSecond)};
  const auto flight = fly(scenario);
  EXPECT_EQ(flight.back().answer.mission, MissionPhase::kFinished);
  // The integral's pole is slow, k_i / (k_v k_p) = 0.06 1/s: 0.3 m · e^(−0.06 · 90 s) remain.
  EXPECT_LE(flight.back().load_error().norm(), 0.01);
}

TEST(PidLawTest, LagsOnTheFigureEightThatQsfTracks) {
  const config::Scenario scenario = make_figure_eight(4'000'000);
  const auto pid = calc_error(fly(fly_with_pid(scenario)), 16.0, 32.0);
  const auto qsf = calc_error(fly(scenario), 16.0, 32.0);
  EXPECT_GT(pid.rms.x(), 100.0 * qsf.rms.x());
  EXPECT_GT(pid.rms.y(), 100.0 * qsf.rms.y());
  EXPECT_LT(pid.max.maxCoeff(), 2.0) << "it loses the load";
}

TEST(PidLawTest, ReportsFaultsWithoutForceOrNan) {
  const PidLaw law(model::SlungLoadParameters{}, PidGains{}, 0.004);
  LawInput falling = make_hover_input({0, 0, 0});
  falling.reference.position << 0, 0, 100;
  EXPECT_EQ(law.calc(falling).error_code, ErrorCode::kFreeFall);
  LawInput level = make_hover_input({0, 0, 0});
  level.state.rod.beta = 1.5707;
  EXPECT_EQ(law.calc(level).error_code, ErrorCode::kRodLevel);
  LawInput broken = make_hover_input({0, 0, 0});
  broken.state.v_WQ.z() = std::numeric_limits<double>::infinity();
  const LawOutput output = law.calc(broken);
  EXPECT_EQ(output.error_code, ErrorCode::kNotFinite);
  EXPECT_EQ(output.f_Q_W, Vector3d::Zero());
}

}  // namespace
}  // namespace sls::control
