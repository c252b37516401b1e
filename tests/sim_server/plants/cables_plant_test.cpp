#include "sim_server/plants/cables/cables_plant.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "tests/sim_server/plants/signals.hpp"
#include "tests/support/errors.hpp"

namespace sls::sim {
namespace {

using Eigen::Vector3d;

/// Two vehicles on a bar along x whose ends are at ±0.2 m, over the point (1, 2, −3).
config::Scenario make_bar() {
  config::Scenario scenario;
  scenario.plant.model.name = "cables";
  scenario.vehicle.quad_mass = 0.5;
  scenario.vehicle.load_mass = 0.1;
  scenario.vehicle.rod_length = 0.8;
  scenario.vehicles.resize(2);
  scenario.vehicles[0].offset = {0.2, 0.0, 0.0};
  scenario.vehicles[1].offset = {-0.2, 0.0, 0.0};
  scenario.plant.initial.position = {1.0, 2.0, -3.0};
  auto& keys = scenario.plant.own.edit<CablesKeys>();
  keys.load_inertia = Vector3d(1e-4, 3e-3, 3e-3);
  keys.cables.resize(2);
  keys.cables[0].attachment = scenario.vehicles[0].offset;
  keys.cables[1].attachment = scenario.vehicles[1].offset;
  return scenario;
}

std::unique_ptr<Plant> make(const config::Scenario& scenario) {
  std::vector<std::uint32_t> ids;
  for (std::uint32_t id = 0; id < scenario.vehicles.size(); ++id) ids.push_back(id);
  return std::move(make_plants(find_plant_type(scenario.plant.model), scenario, ids).at(0).plant);
}

TEST(CablesPlantTest, EachVehicleMeasuresTheEndOfItsOwnCable) {
  config::Scenario scenario = make_bar();
  auto& keys = scenario.plant.own.edit<CablesKeys>();
  keys.cables[1].distance = 0.5;
  keys.cables[1].beta = 0.3;
  const auto plant = make(scenario);
  const double rounding = 1e-15 * 4.0;
  for (const std::size_t i : {0, 1}) {
    const model::Measurement& seen = plant->measurement(i);
    const double sign = i == 0 ? 1.0 : -1.0, distance = i == 0 ? 0.8 : 0.5,
                 beta = i == 0 ? 0.0 : 0.3;
    const Vector3d end(1.0 + sign * 0.2, 2.0, -3.0), n(std::sin(beta), 0.0, std::cos(beta));
    EXPECT_LE((seen.p_WL - end).norm(), rounding);
    EXPECT_LE((seen.p_WQ - (end - distance * n)).norm(), rounding);
    EXPECT_NEAR(seen.rod.beta, beta, rounding);
    EXPECT_EQ(find(*plant, i, "cable_taut"), i == 0 ? 1.0 : 0.0);
    EXPECT_EQ(find(*plant, i, "cable_length_m"), 0.8);
    EXPECT_EQ(find(*plant, i, "load_att_w"), 1.0);
  }
  EXPECT_FALSE(plant->has_attitude());
}

TEST(CablesPlantTest, AnAttitudeTurnsTheLoadAboutTheEndsThatTheVehiclesPlace) {
  config::Scenario scenario = make_bar();
  auto& keys = scenario.plant.own.edit<CablesKeys>();
  keys.load_attitude = Eigen::Quaterniond(std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5));  // x to y
  keys.load_rates = {0.0, 0.0, 2.0};
  scenario.vehicles[0].offset = {0.0, 0.2, 0.0};
  scenario.vehicles[1].offset = {0.0, -0.2, 0.0};
  scenario.plant.initial.v_WQ = {0.5, 0.0, 0.0};
  const auto plant = make(scenario);
  EXPECT_LE((plant->measurement(0).p_WL - Vector3d(1.0, 2.2, -3.0)).norm(), 1e-14);
  // The first vehicle and its end have 0.5 m/s; the other end moves by ω × r = 2 × 0.4 more.
  EXPECT_LE((plant->measurement(0).v_WL - Vector3d(0.5, 0.0, 0.0)).norm(), 1e-14);
  EXPECT_LE((plant->measurement(1).v_WL - Vector3d(1.3, 0.0, 0.0)).norm(), 1e-14);
  EXPECT_LE((plant->measurement(1).v_WQ - Vector3d(1.3, 0.0, 0.0)).norm(), 1e-14);
}

TEST(CablesPlantTest, AFlightGoesOnFromAnInstantOfAnother) {
  config::Scenario scenario = make_bar();
  auto& keys = scenario.plant.own.edit<CablesKeys>();
  keys.cables[0].beta = -0.4;
  keys.cables[1].beta = 0.3;
  keys.load_rates = {0.1, -0.2, 0.5};
  scenario.plant.initial.v_WQ = {0.5, -0.2, 0.1};
  const auto first = make(scenario);
  const auto force = [](int k) {
    return std::vector<Vector3d>{{0.3, 0.1 * std::sin(0.01 * k), -6.0}, {-0.2, 0.0, -5.8}};
  };
  for (int k = 0; k < 300; ++k) first->advance(force(k), 1);

  const model::Numbers& signals = first->measurement(0).signals;  // from 3 on: the load's attitude
  keys.load_attitude = Eigen::Quaterniond(signals[3], signals[4], signals[5], signals[6]);
  keys.load_rates = signals.segment<3>(7);
  const Eigen::Matrix3d R = keys.load_attitude->toRotationMatrix();
  const Vector3d centre = first->measurement(0).p_WL - R * keys.cables[0].attachment;
  for (const std::size_t i : {0, 1}) {
    const model::Measurement& at = first->measurement(i);
    ASSERT_EQ(at.signals[2], 1.0);
    scenario.vehicles[i].v_WQ = at.v_WQ;
    scenario.vehicles[i].offset = centre + R * keys.cables[i].attachment;
    keys.cables[i].alpha = at.rod.alpha;
    keys.cables[i].beta = at.rod.beta;
  }
  scenario.plant.initial.position.setZero();
  keys.cables[0].alpha_dot = first->measurement(0).rod.alpha_dot;
  keys.cables[0].beta_dot = first->measurement(0).rod.beta_dot;
  const auto second = make(scenario);
  for (int k = 300; k < 800; ++k) {
    first->advance(force(k), 1);
    second->advance(force(k), 1);
  }
  for (const std::size_t i : {0, 1}) {
    const model::Measurement &one = first->measurement(i), &other = second->measurement(i);
    EXPECT_LE((one.p_WQ - other.p_WQ).norm(), 1e-12);
    EXPECT_LE((one.v_WL - other.v_WL).norm(), 1e-11);
    EXPECT_EQ(one.signals[2], other.signals[2]);
  }
}

TEST(CablesPlantTest, SharesHangOnTheirCablesAndADropIsReported) {
  config::Scenario scenario = make_bar();
  scenario.vehicles[1].quad_mass = 0.7;
  const auto plant = make(scenario);
  const double share = 0.1 * 9.8;
  std::vector<Vector3d> forces = {Vector3d(0.0, 0.0, -0.5 * 9.8 - share),
                                  Vector3d(0.0, 0.0, -0.7 * 9.8 - share)};
  plant->advance(forces, 500);
  for (const std::size_t i : {0, 1}) {
    EXPECT_NEAR(find(*plant, i, "cable_tension_n"), share, 1e-12);
    EXPECT_NEAR(plant->measurement(i).p_WL.z(), -3.0, 1e-12);
    EXPECT_TRUE(plant->take_remarks(i).empty());
  }
  // A vehicle that falls faster than its end of the bar slackens its cable at once, at 0.5 s.
  forces[0] = {0.0, 0.0, 20.0};
  plant->advance(forces, 1);
  EXPECT_EQ(find(*plant, 0, "cable_tension_n"), 0.0);
  EXPECT_EQ(plant->take_remarks(0), (std::vector<std::string>{"cable slack at 0.500000000 s"}));
  EXPECT_TRUE(plant->take_remarks(0).empty());
  EXPECT_TRUE(plant->take_remarks(1).empty());
}

TEST(CablesPlantTest, SaysWhenNoCableCarriesTheLoadAndLimitsItsRemarksOnEachTopic) {
  config::Scenario scenario;
  scenario.plant.model.name = "cables";
  scenario.plant.own.edit<CablesKeys>().cables.resize(1);
  scenario.plant.own.edit<CablesKeys>().cables[0].release_ns = 3'900'000'000;
  const auto plant = make(scenario);
  std::vector<std::string> remarks;
  for (int k = 0; k < 400; ++k) {  // pushes and pulls in turn
    plant->advance({Vector3d(0.0, 0.0, k % 2 == 0 ? 5.0 : -40.0)}, 10);
    for (const std::string& remark : plant->take_remarks(0)) remarks.push_back(remark);
  }
  ASSERT_EQ(remarks.size(), 22u);
  EXPECT_EQ(remarks[0], "cable slack at 0.000000000 s; no cable carries the load");
  EXPECT_EQ(remarks[1].rfind("cable taut at 0.01", 0), 0u) << remarks[1];
  EXPECT_EQ(remarks[20], "cable: no further remark on it");
  EXPECT_EQ(remarks[21], "cable released at 3.900000000 s; no cable carries the load");
}

TEST(CablesPlantTest, AdvancesInAnyNumberOfCallsWithTheSameBitsThroughEvents) {
  config::Scenario scenario = make_bar();
  scenario.plant.own.edit<CablesKeys>().cables[0].distance = 0.3;
  const auto at_once = make(scenario), in_parts = make(scenario);
  int taut = 0;
  for (int period = 0; period < 100; ++period) {
    const std::vector<Vector3d> forces = {Vector3d(0.01 * period, -0.3, -6.0),
                                          Vector3d(0.2, 0.1, period % 7 < 3 ? -4.0 : -9.0)};
    at_once->advance(forces, 7);
    for (const int steps : {2, 0, 4, 1}) in_parts->advance(forces, steps);
    for (const std::size_t i : {0, 1}) {
      const model::Measurement &a = at_once->measurement(i), &b = in_parts->measurement(i);
      ASSERT_EQ(a.p_WQ, b.p_WQ) << period;
      ASSERT_EQ(a.v_WL, b.v_WL) << period;
      ASSERT_EQ(a.signals, b.signals) << period;
      ASSERT_EQ(at_once->take_remarks(i), in_parts->take_remarks(i)) << period;
      taut += a.signals[2] == 1.0;
    }
  }
  EXPECT_GT(taut, 20);
  EXPECT_LT(taut, 180) << "no cable was slack";
}

/// A vehicle of 1.5 kg that hovers with a load of 0.2 kg at z = −1.5 m below it.
config::Scenario make_alone() {
  config::Scenario scenario;
  scenario.plant.model.name = "cables";
  scenario.plant.initial.position = {0.0, 0.0, -1.5};
  scenario.plant.own.edit<CablesKeys>().cables.resize(1);
  return scenario;
}

TEST(CablesPlantTest, AWinchFollowsItsScheduleAtEveryTimeAndSaysSo) {
  // 0.08 m at 0.2 m/s and 1 m/s²: ramps of 0.2 s and 0.02 m, 0.2 s between. It begins inside a
  // step.
  config::Scenario scenario = make_alone();
  scenario.plant.own.edit<CablesKeys>().cables[0].winch = {
      0.5, 2.0, {{100'500'000, 1.08, 0.2, 1.0}, {1'000'000'000, 0.6, 5.0, 2.0}}};
  const auto plant = make(scenario);
  const auto wanted = [](double t) {
    const double s = t - 0.1005;
    if (s < 0.0) return 1.0;
    if (s < 0.2) return 1.0 + 0.5 * s * s;
    if (s < 0.4) return 1.02 + 0.2 * (s - 0.2);
    if (s < 0.6) return 1.08 - 0.5 * (0.6 - s) * (0.6 - s);
    const double r = t - 1.0, half = std::sqrt(0.48 / 2.0);
    if (r < 0.0) return 1.08;
    if (r < half) return 1.08 - r * r;
    if (r < 2.0 * half) return 0.6 + (2.0 * half - r) * (2.0 * half - r);
    return 0.6;
  };
  std::vector<std::string> remarks;
  for (int k = 1; k <= 2500; ++k) {
    plant->advance({Vector3d(0.0, 0.0, -1.7 * 9.8)}, 1);
    const model::Measurement& seen = plant->measurement(0);
    ASSERT_NEAR(find(*plant, 0, "cable_length_m"), wanted(0.001 * k), 1e-13) << k;
    ASSERT_NEAR((seen.p_WL - seen.p_WQ).norm(), wanted(0.001 * k), 1e-13) << k;
    ASSERT_EQ(find(*plant, 0, "cable_taut"), 1.0) << k;
    if (k == 400) {
      ASSERT_NEAR(find(*plant, 0, "cable_length_rate_m_s"), 0.2, 1e-13);
    }
    for (const std::string& remark : plant->take_remarks(0)) remarks.push_back(remark);
  }
  EXPECT_EQ(find(*plant, 0, "cable_length_m"), 0.6);
  EXPECT_EQ(find(*plant, 0, "cable_length_rate_m_s"), 0.0);
  EXPECT_EQ(remarks, (std::vector<std::string>{"winch starts towards 1.08 m at 0.100500000 s",
                                               "winch stops at 1.08 m at 0.700500000 s",
                                               "winch starts towards 0.6 m at 1.000000000 s",
                                               "winch stops at 0.6 m at 1.979795897 s"}));
}

TEST(CablesPlantTest, AReleaseInsideAStepLeavesTheLoadInFreeFall) {
  config::Scenario scenario = make_alone();
  scenario.plant.initial.rod.beta_dot = 0.8;
  scenario.plant.own.edit<CablesKeys>().cables[0].release_ns = 250'400'000;
  const auto plant = make(scenario);
  EXPECT_EQ(find(*plant, 0, "cable_released"), 0.0);
  const std::vector<Vector3d> hover = {Vector3d(0.0, 0.0, -1.7 * 9.8)};
  plant->advance(hover, 251);
  EXPECT_EQ(
      plant->take_remarks(0),
      (std::vector<std::string>{"cable released at 0.250400000 s; no cable carries the load"}));
  EXPECT_EQ(find(*plant, 0, "cable_released"), 1.0);
  EXPECT_EQ(find(*plant, 0, "cable_tension_n"), 0.0);
  EXPECT_EQ(find(*plant, 0, "cable_taut"), 0.0);
  const model::Measurement after = plant->measurement(0);
  plant->advance(hover, 1000);
  const model::Measurement& end = plant->measurement(0);
  EXPECT_LE((end.p_WL - after.p_WL - after.v_WL - Vector3d(0.0, 0.0, 4.9)).norm(), 1e-12);
  // The cut cable hangs.
  EXPECT_EQ(end.rod.alpha, 0.0);
  EXPECT_EQ(end.rod.beta, 0.0);
  EXPECT_EQ(end.rod.beta_dot, 0.0);
  EXPECT_TRUE(plant->take_remarks(0).empty());
}

TEST(CablesPlantTest, TellsWhatStandsOnTheGround) {
  config::Scenario scenario = make_alone();
  auto& keys = scenario.plant.own.edit<CablesKeys>();
  keys.ground_z = 0.25;
  keys.cables[0].distance = 0.6;
  scenario.plant.initial.position.z() = 0.25;
  const auto plant = make(scenario);
  EXPECT_EQ(find(*plant, 0, "load_on_ground"), 1.0);
  EXPECT_EQ(find(*plant, 0, "vehicle_on_ground"), 0.0);
  // Up at 2 m/s² for 0.4 m of slack, then with the load, then all falls.
  plant->advance({Vector3d(0.0, 0.0, -1.5 * 11.8)}, 800);
  EXPECT_EQ(find(*plant, 0, "load_on_ground"), 0.0);
  plant->advance({Vector3d(0.0, 0.0, 0.0)}, 1000);
  EXPECT_EQ(find(*plant, 0, "load_on_ground"), 1.0);
  EXPECT_EQ(find(*plant, 0, "vehicle_on_ground"), 1.0);
  EXPECT_EQ(plant->measurement(0).p_WL, Vector3d(0.0, 0.0, 0.25));
  const std::vector<std::string> remarks = plant->take_remarks(0);
  ASSERT_EQ(remarks.size(), 5u);
  EXPECT_EQ(remarks[0].substr(0, 24), "cable taut at 0.63245553");
  EXPECT_EQ(remarks[1].substr(0, 25), "load lifts off at 0.63245");
  // Both fall alike until the load stands.
  const std::string time = remarks[3].substr(18);
  EXPECT_EQ(remarks[2], "cable slack" + time + "; no cable carries the load");
  EXPECT_EQ(remarks[3], "load on the ground" + time);
  EXPECT_EQ(remarks[4].substr(0, 21), "vehicle on the ground");
}

TEST(CablesPlantTest, ACableThatLiesAlongXOnTheGroundHasNoAlphaAndRisesFromIt) {
  config::Scenario scenario = make_bar();
  auto& keys = scenario.plant.own.edit<CablesKeys>();
  keys.ground_z = -3.0;
  for (CableKeys& cable : keys.cables) {
    cable.distance = 0.5;
    cable.beta = -0.5 * M_PI;
  }
  const auto plant = make(scenario);
  const std::vector<Vector3d> rising(2, {0.0, 0.0, -6.9});  // 2 N more than 0.5 kg
  for (int step = 0; step < 300; ++step) {
    for (const std::size_t i : {0, 1}) {
      const model::SlungLoadState& at = plant->measurement(i);
      const double height = -3.0 - at.p_WQ.z();
      ASSERT_EQ(at.rod.alpha, 0.0);
      ASSERT_EQ(at.rod.alpha_dot, 0.0);
      ASSERT_NEAR(at.rod.beta, -std::atan2(0.5, height), 1e-12);
    }
    plant->advance(rising, 1);
  }
  EXPECT_EQ(find(*plant, 0, "vehicle_on_ground"), 0.0);
}

TEST(CablesPlantTest, HasNoSignalsOfWhatTheScenarioHasNot) {
  const auto plant = make(make_alone());
  EXPECT_EQ(plant->signals().size(), 10u);
}

TEST(CablesPlantTest, RefusesToFlyOneVehicleOfAGroupAlone) {
  const config::Scenario scenario = make_bar();
  EXPECT_EQ(test::find_error<config::ConfigError>([&] {
              make_plant(find_plant_type(scenario.plant.model),
                         config::make_vehicle_scenario(scenario, 1), 1);
            }),
            "plant.cables: expected one for each of 1 vehicles, got 2");
}

}  // namespace
}  // namespace sls::sim
