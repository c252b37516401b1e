/// Thrust that differs from what is wanted: scales, drift, battery, failures.
#include <gtest/gtest.h>

#include <cmath>

#include "sim_server/autopilots/geometric/keys.hpp"
#include "sim_server/plants/cables/keys.hpp"
#include "sim_server/plants/multirotor/keys.hpp"
#include "sim_server/plants/plant.hpp"
#include "tests/sim_server/plants/signals.hpp"

namespace sls::sim {
namespace {

using Eigen::Vector3d;

std::vector<PlantOfVehicles> make(const config::Scenario& scenario) {
  std::vector<std::uint32_t> ids;
  for (std::uint32_t id = 0; id < scenario.vehicles.size(); ++id) ids.push_back(id);
  return make_plants(find_plant_type(scenario.plant.model), scenario, ids);
}

TEST(ThrustTest, APointMassGetsItsOwnScaleWithDriftUntilItFails) {
  for (const char* model : {"analytic", "slung_load", "cables"}) {
    SCOPED_TRACE(model);
    config::Scenario scenario;
    scenario.plant.model.name = model;
    scenario.vehicles.resize(1);
    scenario.vehicles[0].thrust_scale = 0.9;
    scenario.plant.thrust.drift = -0.1;
    scenario.plant.thrust.failures = {{1'000'000'000, 0, {}, 0.5}};
    config::Scenario plain;
    plain.plant.model.name = model;
    const auto tired = make(scenario), fresh = make(plain);
    const Vector3d force(0.5, -0.3, -17.0);
    for (int k = 0; k < 2000; ++k) {
      tired[0].plant->advance({force}, 1);
      const double scale = 0.9 * (1.0 - 0.1 * 0.001 * k) * (k < 1000 ? 1.0 : 0.5);
      fresh[0].plant->advance({scale * force}, 1);
    }
    EXPECT_LE((tired[0].plant->measurement(0).p_WL - fresh[0].plant->measurement(0).p_WL).norm(),
              1e-11);
    EXPECT_NEAR(find(*tired[0].plant, 0, "thrust_scale"), 0.9 * 0.8 * 0.5, 1e-12);
  }
}

TEST(ThrustTest, AllVehiclesOfAFleetHaveTheSameSignals) {
  config::Scenario scenario;
  scenario.vehicles.resize(2);
  scenario.vehicles[1].thrust_scale = 0.9;
  const auto plants = make(scenario);
  for (const std::size_t i : {0, 1})
    EXPECT_EQ(find(*plants[i].plant, 0, "thrust_scale"), i == 0 ? 1.0 : 0.9);
}

/// A quadrotor whose rotors are at (±0.2, ±0.2) m, alone or on a cable.
config::Scenario make_quadrotor(const std::string& model) {
  config::Scenario scenario;
  scenario.plant.model.name = model;
  AirframeKeys airframe;
  airframe.inertia = {0.03, 0.03, 0.05};
  airframe.rotor.thrust_constant = 5e-6;
  airframe.rotor.torque_constant = 0.05;
  airframe.rotor.max_speed = 1500.0;
  for (const auto& [x, y, spin] :
       {std::tuple{0.2, 0.2, Spin::kCounterClockwise},
        std::tuple{-0.2, -0.2, Spin::kCounterClockwise}, std::tuple{0.2, -0.2, Spin::kClockwise},
        std::tuple{-0.2, 0.2, Spin::kClockwise}}) {
    airframe.rotors.emplace_back();
    airframe.rotors.back().position = {x, y, 0.0};
    airframe.rotors.back().spin = spin;
  }
  if (model == "cables") {
    scenario.plant.own.edit<CablesKeys>().airframe = airframe;
  } else {
    static_cast<AirframeKeys&>(scenario.plant.own.edit<MultirotorKeys>()) = airframe;
  }
  scenario.autopilot.emplace();
  scenario.autopilot->model.name = "geometric";
  scenario.autopilot->own = geometric::Keys{10.0, 2.0};
  scenario.autopilot->period_ns = 4'000'000;
  return scenario;
}

TEST(ThrustTest, ARotorThatFailsTurnsTheBodyByItsLostThrust) {
  for (const char* model : {"multirotor", "cables"}) {
    SCOPED_TRACE(model);
    config::Scenario scenario = make_quadrotor(model);
    scenario.plant.thrust.failures = {{101'000'000, 0, 1, 0.25}};
    const auto plants = make(scenario);
    Plant& plant = *plants[0].plant;
    const std::vector<Vector3d> hover = {Vector3d(0.0, 0.0, -1.7 * 9.8)};
    plant.advance(hover, 101);
    EXPECT_LE(plant.measurement(0).attitude.w_WB_B.norm(), 1e-12);
    const double thrust = find(plant, 0, "thrust_n");
    EXPECT_NEAR(thrust, 1.7 * 9.8, 1e-9);
    plant.advance(hover, 1);  // the autopilot comes again at 104 ms
    // Three quarters of a rotor's thrust are missing at (0.2, 0.2), and its drag, to the left.
    const double lost = 0.75 * thrust / 4.0;
    const Vector3d torque =
        Vector3d(0.2, 0.2, 0.0).cross(Vector3d(0.0, 0.0, lost)) + Vector3d(0.0, 0.0, -0.05 * lost);
    const Vector3d expected =
        0.001 * Vector3d(torque.x() / 0.03, torque.y() / 0.03, torque.z() / 0.05);
    EXPECT_LE((plant.measurement(0).attitude.w_WB_B - expected).norm(), 1e-7);  // gyroscopic
    EXPECT_NEAR(find(plant, 0, "thrust_n"), thrust - lost, 1e-9);
  }
}

TEST(ThrustTest, RotorsHaveScalesOfTheirOwnThatTheAutopilotDoesNotKnow) {
  config::Scenario scenario = make_quadrotor("cables");
  scenario.plant.thrust.scale = 0.9;
  for (RotorKeys& rotor : scenario.plant.own.edit<CablesKeys>().airframe->rotors)
    rotor.thrust_scale = 1.1;
  const auto plants = make(scenario);
  plants[0].plant->advance({Vector3d(0.0, 0.0, -1.7 * 9.8)}, 10);
  EXPECT_NEAR(find(*plants[0].plant, 0, "thrust_n"), 0.99 * 1.7 * 9.8, 1e-9);
  EXPECT_NEAR(find(*plants[0].plant, 0, "thrust_set_n"), 1.7 * 9.8, 1e-9);
}

TEST(ThrustTest, ABatteryGivesTheEnergyThatTheHoverTakes) {
  // Energy from the battery = hover power × time + heat: both sides by the recorded voltage.
  for (const bool has_rotors : {false, true}) {
    config::Scenario scenario = has_rotors ? make_quadrotor("cables") : config::Scenario();
    scenario.plant.thrust.battery = config::Battery{16.8, 14.0, 0.05, 0.2, 200.0};
    const auto plants = make(scenario);
    Plant& plant = *plants[0].plant;
    double heat = 0.0, used = 0.0, chemical = 0.0, charge = 1.0;
    for (int k = 0; k < 4000; ++k) {
      const double scale = find(plant, 0, "thrust_scale");
      const double before = charge;
      // The force is wanted so that the true one holds the weight.
      plant.advance({Vector3d(0.0, 0.0, -1.7 * 9.8 / scale)}, 1);
      charge = find(plant, 0, "battery_charge");
      const double current = (before - charge) * 0.2 * 3600.0 / 0.001;
      heat += 0.05 * current * current * 0.001;
      used += find(plant, 0, "battery_v") * current * 0.001;
      chemical += (14.0 + 2.8 * charge) * current * 0.001;
    }
    EXPECT_NEAR(used, 200.0 * 4.0, has_rotors ? 2.0 : 5e-3);
    EXPECT_NEAR(chemical, used + heat, 1e-2);
    EXPECT_NEAR(find(plant, 0, "thrust_scale"), std::pow(find(plant, 0, "battery_v") / 16.8, 2),
                1e-12);
  }
}

}  // namespace
}  // namespace sls::sim
