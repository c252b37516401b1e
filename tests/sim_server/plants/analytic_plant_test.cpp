#include "sim_server/plants/analytic/analytic_plant.hpp"

#include <gtest/gtest.h>

#include "common/model/invariants.hpp"
#include "tests/sim_server/plants/plant_flights.hpp"
#include "tests/support/errors.hpp"

namespace sls::sim {
namespace {

using Eigen::Vector3d;

const model::SlungLoadParameters kVehicle;

config::Plant make_tilted_plant() {
  config::Plant plant;
  plant.initial.position = {0.2, -0.1, -1.0};
  plant.initial.v_WQ = {0.1, 0.2, -0.1};
  plant.initial.rod = {0.3, -0.2, 0.5, 0.4};
  return plant;
}

TEST(AnalyticPlantTest, FollowsSimbodyForThirtyTwoSecondsWithDragWindAndDisturbance) {
  config::Plant config = make_tilted_plant();
  config.air.rotor_drag = 0.3;
  config.air.v_wind_W = {2.0, -1.0, 0.3};
  config.disturbance_W = {0.3, -0.2, 0.1};
  AnalyticPlant plant(kVehicle, config);
  SlungLoadPlant simbody(kVehicle, config);
  double largest = calc_position_difference(plant.measurement(0), simbody.state());
  double tilt = 0.0;
  for (int k = 0; k < 32'000; ++k) {
    const model::SlungLoadState& state = simbody.state();
    const Vector3d force = calc_shaking_force(k * kStep, state.p_WQ, state.v_WQ,
                                              kVehicle.total_mass(), kVehicle.gravity);
    simbody.step(force);
    plant.advance({force}, 1);
    largest = std::max(largest, calc_position_difference(plant.measurement(0), simbody.state()));
    tilt = std::max(tilt, calc_tilt(state.p_WL - state.p_WQ));
  }
  EXPECT_GT(tilt, 0.3) << "the flight does not swing";
  // Both use fourth-order Runge-Kutta at 1 ms, but different coordinates: their truncation errors
  // differ by about 1e-10 m.
  EXPECT_LE(largest, 1e-9);
}

TEST(AnalyticPlantTest, BeginsWhereTheScenarioPutsEitherBody) {
  for (const config::Body placed : {config::Body::kQuadrotor, config::Body::kLoad}) {
    config::Plant plant = make_tilted_plant();
    plant.initial.placed = placed;
    const model::SlungLoadState state = AnalyticPlant(kVehicle, plant).measurement(0);
    const Vector3d& p_placed = placed == config::Body::kLoad ? state.p_WL : state.p_WQ;
    const double rounding = 1e-14;  // of numbers up to 1
    EXPECT_LE((p_placed - plant.initial.position).norm(), rounding);
    EXPECT_LE((state.v_WQ - plant.initial.v_WQ).norm(), rounding);
    EXPECT_NEAR(state.rod.alpha, 0.3, rounding);
    EXPECT_NEAR(state.rod.beta, -0.2, rounding);
    EXPECT_NEAR(state.rod.alpha_dot, 0.5, rounding);
    EXPECT_NEAR(state.rod.beta_dot, 0.4, rounding);
  }
}

TEST(AnalyticPlantTest, KeepsEnergyLessTheHeldForcesWorkAndTheRodsLength) {
  AnalyticPlant plant(kVehicle, make_tilted_plant());
  const Vector3d force(0.5, -0.3, -15.0);
  const model::SlungLoadState start = plant.measurement(0);
  plant.advance({force}, 2000);
  const model::SlungLoadState& end = plant.measurement(0);
  const double work = force.dot(end.p_WQ - start.p_WQ);
  const double gained = calc_energy(end, kVehicle) - calc_energy(start, kVehicle);
  EXPECT_NEAR(gained, work, 1e-9);  // truncation (ωh)⁴ ≈ 1e-11 of some 10 J
  EXPECT_LE(calc_rod_length_error(end, kVehicle.rod_length), 1e-14);
}

TEST(AnalyticPlantTest, ConvergesWithTheFourthOrderOfItsStep) {
  const auto fly_with = [](std::int64_t step_ns) {
    config::Plant config = make_tilted_plant();
    config.air.rotor_drag = 0.5;
    config.step_ns = step_ns;
    AnalyticPlant plant(kVehicle, config);
    plant.advance({Vector3d(0.4, 0.3, -16.0)}, 2'000'000'000 / step_ns);
    return model::SlungLoadState(plant.measurement(0));
  };
  const model::SlungLoadState fine = fly_with(1'000'000);
  const double at_20 = calc_position_difference(fly_with(20'000'000), fine);
  const double at_10 = calc_position_difference(fly_with(10'000'000), fine);
  EXPECT_NEAR(std::log2(at_20 / at_10), 4.0, 0.2);
}

/// Every kind of plant that flies one vehicle.
std::vector<PlantOfVehicles> make(const std::string& model, const config::Scenario& scenario) {
  return make_plants(find_plant_type({model, ""}), scenario, {0});
}

TEST(PlantTest, AdvancesInAnyNumberOfCallsWithTheSameBits) {
  config::Scenario scenario;
  scenario.plant = make_tilted_plant();
  scenario.plant.air.rotor_drag = 0.2;
  for (const char* model : {"slung_load", "analytic", "cables"}) {
    auto at_once = make(model, scenario), in_parts = make(model, scenario);
    for (int period = 0; period < 100; ++period) {
      const std::vector<Vector3d> force = {Vector3d(0.01 * period, -0.3, -16.0)};
      at_once[0].plant->advance(force, 7);
      for (const int steps : {2, 0, 4, 1}) in_parts[0].plant->advance(force, steps);
      const model::SlungLoadState &a = at_once[0].plant->measurement(0),
                                  &b = in_parts[0].plant->measurement(0);
      ASSERT_EQ(a.p_WQ, b.p_WQ) << model;
      ASSERT_EQ(a.v_WL, b.v_WL) << model;
      ASSERT_EQ(a.rod.alpha_dot, b.rod.alpha_dot) << model;
    }
  }
}

TEST(PlantTest, RefusesAForceThatIsNotFiniteAndKeepsItsState) {
  for (const char* model : {"slung_load", "analytic", "cables"}) {
    config::Scenario scenario;
    auto plants = make(model, scenario);
    plants[0].plant->advance({Vector3d(0, 0, -16)}, 3);
    const Vector3d before = plants[0].plant->measurement(0).p_WL;
    EXPECT_EQ(test::find_error<std::runtime_error>(
                  [&] { plants[0].plant->advance({Vector3d(0, std::nan(""), 0)}, 1); }),
              "force_y_n is not finite after step 3 of the plant")
        << model;
    EXPECT_THROW(plants[0].plant->advance({Vector3d(1e308, 0, 0)}, 5), std::runtime_error);
    EXPECT_TRUE(model::is_finite(plants[0].plant->measurement(0)));
    EXPECT_LE((plants[0].plant->measurement(0).p_WL - before).norm(), 1e-3) << model;
  }
}

// --- plants that move all vehicles together ------------------------------------------------------

/// Points that move in proportion to their force, all in one plant.
class Swarm : public Plant {
 public:
  explicit Swarm(const PlantSetup& setup) {
    for (const auto& vehicle : setup.vehicles) {
      model::SlungLoadState state;
      state.p_WQ = vehicle.initial.position;
      vehicles_.emplace_back(state);
    }
  }
  void advance(const std::vector<Vector3d>& f_Q_W, std::int64_t steps) override {
    for (std::size_t i = 0; i < vehicles_.size(); ++i)
      vehicles_[i].p_WQ += static_cast<double>(steps) * f_Q_W[i];
  }
  const model::Measurement& measurement(std::size_t vehicle) const override {
    return vehicles_[vehicle];
  }

 private:
  std::vector<model::Measurement> vehicles_;
};

TEST(PlantTest, APlantOfAllVehiclesIsMadeOnceAndRefusesAPartOfTheFleet) {
  const PlantType swarm{Moves::kAllVehicles, [](const PlantSetup& setup) {
                          return std::unique_ptr<Plant>(std::make_unique<Swarm>(setup));
                        }};
  config::Scenario fleet;
  fleet.plant.model.name = "swarm";
  fleet.vehicles = config::make_vehicle_grid(3);
  auto plants = make_plants(swarm, fleet, {0, 1, 2});
  ASSERT_EQ(plants.size(), 1u);
  EXPECT_EQ(plants[0].vehicles, (std::vector<std::size_t>{0, 1, 2}));
  plants[0].plant->advance({Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)}, 2);
  for (std::uint32_t id = 0; id < 3; ++id) {
    Vector3d expected = config::make_vehicle_scenario(fleet, id).plant.initial.position;
    expected[id] += 2.0;
    EXPECT_EQ(plants[0].plant->measurement(id).p_WQ, expected);
  }
  EXPECT_EQ(test::find_error<config::ConfigError>([&] {
              make_plants(swarm, fleet, {0, 2});
            }),
            "plant.model: expected a server of all 3 vehicles, which 'swarm' moves together, got "
            "one of 0,2");
}

}  // namespace
}  // namespace sls::sim
