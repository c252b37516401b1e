// The allocation of `geometric`: the rotors together produce the requested thrust and moment.
#include "sim_server/autopilots/geometric/allocation.hpp"

#include <gtest/gtest.h>

#include "tests/sim_server/autopilots/airframes.hpp"
#include "tests/support/errors.hpp"

namespace sls::sim::geometric {
namespace {

using namespace sim::test;  // NOLINT: the tests' own folder

VectorXd to_speeds(const Airframe& airframe, const VectorXd& thrusts) {
  VectorXd speeds = thrusts;
  for (std::size_t i = 0; i < airframe.rotors.size(); ++i) {
    double& number = speeds[static_cast<Eigen::Index>(i)];
    number = std::sqrt(number / airframe.rotors[i].thrust_constant);
  }
  return speeds;
}

std::vector<Airframe> make_airframes() {
  Airframe heavy_on_one_side = make_published_airframe();
  heavy_on_one_side.p_BC = {0.02, -0.01, 0.03};
  Airframe canted = make_ring(6);
  for (Rotor& rotor : canted.rotors)
    rotor.axis_B = (Vector3d(0, 0, -1) + 0.5 * rotor.p_BR).normalized();
  Airframe unlike = make_ring(5);
  unlike.rotors[1].thrust_constant = 8e-6;
  unlike.rotors[2].torque_constant = 0.02;
  return {make_published_airframe(), heavy_on_one_side, make_ring(6), make_ring(8), canted, unlike};
}

TEST(AllocationTest, MakesTheMomentAndTheThrustThatAreAskedFor) {
  std::mt19937_64 random(51);
  for (const Airframe& airframe : make_airframes()) {
    const Allocation allocation(make_setup(airframe));
    for (int i = 0; i < 100; ++i) {
      const Vector3d moment = make_random_vector(random).cwiseProduct(Vector3d(0.3, 0.3, 0.05));
      const VectorXd speeds = to_speeds(airframe, allocation.calc_thrusts(moment, 12.0));
      EXPECT_NEAR((calc_torque(airframe, speeds) - moment).norm(), 0.0, 1e-12);
      EXPECT_NEAR(calc_lift(airframe, speeds), 12.0, 1e-11);
    }
  }
}

TEST(AllocationTest, MoreThanFourRotorsUseTheLeastThrusts) {
  // The pseudo-inverse is the solution with the smallest sum of squares: it has no part in the
  // space of thrusts that produce neither moment nor lift.
  const Airframe airframe = make_ring(6);
  const VectorXd thrusts = Allocation(make_setup(airframe)).calc_thrusts({0.1, -0.2, 0.02}, 12.0);
  Eigen::MatrixXd effects(4, 6);
  for (int i = 0; i < 6; ++i) {
    VectorXd speeds = VectorXd::Zero(6);
    speeds[i] = std::sqrt(1.0 / 5e-6);
    effects.col(i) << calc_torque(airframe, speeds), calc_lift(airframe, speeds);
  }
  const Eigen::MatrixXd idle = Eigen::FullPivLU<Eigen::MatrixXd>(effects).kernel();
  ASSERT_EQ(idle.cols(), 2);
  EXPECT_NEAR((idle.transpose() * thrusts).norm(), 0.0, 1e-12);
}

TEST(AllocationTest, KeepsRollAndPitchWhereThrustOrYawDoNotFit) {
  std::mt19937_64 random(52);
  std::uniform_real_distribution<double> any(0.0, 24.2);
  const Airframe airframe = make_published_airframe();
  const Allocation allocation(make_setup(airframe));
  for (int i = 0; i < 10'000; ++i) {
    const Vector3d moment = 0.9 * make_random_vector(random);  // near the largest possible
    const double thrust = any(random);
    const VectorXd thrusts = allocation.calc_thrusts(moment, thrust);
    ASSERT_GE(thrusts.minCoeff(), 0.0);
    ASSERT_LE(thrusts.maxCoeff(), 6.05 + 1e-12);
    const Vector3d made = calc_torque(airframe, to_speeds(airframe, thrusts));
    ASSERT_NEAR((made - moment).head<2>().norm(), 0.0, 1e-11);
    ASSERT_GE(made.z() * moment.z(), -1e-12);
    ASSERT_LE(std::abs(made.z()), std::abs(moment.z()) + 1e-12);
  }
}

TEST(AllocationTest, WithoutThrustItStillTurnsTheBody) {
  const Airframe airframe = make_published_airframe();
  const VectorXd thrusts = Allocation(make_setup(airframe)).calc_thrusts({0.5, 0, 0}, 0.0);
  EXPECT_NEAR(calc_torque(airframe, to_speeds(airframe, thrusts)).x(), 0.5, 1e-12);
  EXPECT_NEAR(thrusts.minCoeff(), 0.0, 1e-15);
}

TEST(AllocationTest, LeavesYawOutWithoutAuthority) {
  for (const double constant : {0.0, 0.05}) {
    Airframe airframe = make_ring(4);
    for (Rotor& rotor : airframe.rotors) {
      rotor.spin = 1.0;
      rotor.torque_constant = constant;
    }
    const Allocation allocation(make_setup(airframe));
    const VectorXd thrusts = allocation.calc_thrusts({0.1, 0.2, 0.3}, 12.0);
    const VectorXd speeds = to_speeds(airframe, thrusts);
    EXPECT_NEAR((calc_torque(airframe, speeds) - Vector3d(0.1, 0.2, 0)).head<2>().norm(), 0.0,
                1e-12);
    EXPECT_NEAR(calc_lift(airframe, speeds), 12.0, 1e-12);
  }
}

TEST(AllocationTest, FramesThatCannotRollOrPitchAreRefused) {
  for (const int axis : {0, 1}) {
    Airframe airframe = make_published_airframe();
    for (Rotor& rotor : airframe.rotors) rotor.p_BR[axis] = 0.0;
    AutopilotSetup setup = make_setup(airframe);
    setup.autopilot.model.place = "file:7";
    EXPECT_EQ(
        sls::test::find_error<config::ConfigError>([&] { Allocation{setup}; }),
        "file:7: plant.rotors: expected rotors that roll and pitch the body, got 4 that cannot");
  }
  Airframe single = make_published_airframe();
  single.rotors.resize(1);
  EXPECT_THROW(Allocation{make_setup(single)}, config::ConfigError);
}

}  // namespace
}  // namespace sls::sim::geometric
