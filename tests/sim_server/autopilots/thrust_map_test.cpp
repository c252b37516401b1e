// The thrust maps of `px4` are the inverse of the rotors' thrust.
#include "sim_server/autopilots/px4/thrust_map.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/sim_server/autopilots/airframes.hpp"

namespace sls::sim::px4 {
namespace {

using sim::test::make_published_airframe, sim::test::make_ring, sim::test::make_setup;

TEST(ThrustMapTest, ExactMapGivesTheForceThatIsAskedFor) {
  for (const Airframe& airframe : {make_published_airframe(), make_ring(6)})
    for (const SpeedMap& speeds : {SpeedMap{}, SpeedMap{0.0, 800.0}, SpeedMap{300.0, 500.0}}) {
      const std::vector<MixerRow> mixer = make_mixer(make_setup(airframe));
      const ExactThrust map(airframe.rotors, mixer, speeds);
      for (double thrust = 0.01; thrust <= 1.0; thrust += 0.01) {
        double force = 0.0;
        for (std::size_t i = 0; i < mixer.size(); ++i)
          force +=
              airframe.rotors[i].thrust_constant *
              std::pow(speeds.speed_per_output * thrust * mixer[i].thrust + speeds.speed_at_zero,
                       2);
        EXPECT_NEAR(map.calc_thrust(force), thrust, 1e-13);
      }
    }
}

TEST(ThrustMapTest, ExactMapCountsOnlyTheLiftOfRotorsThatAreTilted) {
  Airframe airframe = make_ring(6);
  for (Rotor& rotor : airframe.rotors)
    rotor.axis_B = (Eigen::Vector3d(0, 0, -1) + 0.3 * rotor.p_BR).normalized();
  const std::vector<MixerRow> mixer(6, MixerRow{});
  const double thrust = ExactThrust(airframe.rotors, mixer, {}).calc_thrust(12.0);
  const Eigen::VectorXd speeds = Eigen::VectorXd::Constant(6, 1000.0 * thrust + 100.0);
  EXPECT_NEAR(sim::test::calc_lift(airframe, speeds), 12.0, 1e-12);
}

TEST(ThrustMapTest, ExactMapEndsAtZeroAndOne) {
  const Airframe airframe = make_published_airframe();
  const ExactThrust map(airframe.rotors, make_mixer(make_setup(airframe)), {});
  EXPECT_EQ(map.calc_thrust(0.0), 0.0);
  EXPECT_EQ(map.calc_thrust(0.1), 0.0);  // at least speed the rotors produce 0.2 N
  EXPECT_EQ(map.calc_thrust(30.0), 1.0);
}

TEST(ThrustMapTest, ExactMapRefusesRotorsThatPushDown) {
  Airframe airframe = make_published_airframe();
  const std::vector<MixerRow> mixer = make_mixer(make_setup(airframe));
  for (Rotor& rotor : airframe.rotors) rotor.axis_B = Eigen::Vector3d::UnitZ();
  EXPECT_THROW(ExactThrust(airframe.rotors, mixer, {}), std::invalid_argument);
}

TEST(ThrustMapTest, AffineMapIsThePublishedLine) {
  EXPECT_DOUBLE_EQ(calc_affine_thrust({}, 16.67122), 0.8168);
  EXPECT_DOUBLE_EQ(calc_affine_thrust({}, 14.67122), 0.7168);
  EXPECT_EQ(calc_affine_thrust({}, 0.0), 0.0);
  EXPECT_EQ(calc_affine_thrust({}, 20.4), 1.0);
  EXPECT_DOUBLE_EQ(calc_affine_thrust({10.0, 0.5, 40.0}, 14.0), 0.6);
}

}  // namespace
}  // namespace sls::sim::px4
