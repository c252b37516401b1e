/// Wind that changes, and the drag of the load, in every plant.
#include "sim_server/plants/air/air.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "sim_server/plants/cables/keys.hpp"
#include "sim_server/plants/multirotor/keys.hpp"
#include "sim_server/plants/slung_load/keys.hpp"
#include "sim_server/plants/slung_load/rigid_links.hpp"
#include "tests/sim_server/plants/plant_flights.hpp"
#include "tests/support/errors.hpp"

namespace sls::sim {
namespace {

using Eigen::Vector3d;

constexpr double kTwoPi = 6.283185307179586;

// --- turbulence --------------------------------------------------------------------------------

/// One-sided spectra of the standard over x = ω L / V, of unit variance over dx. MIL-F-8785C,
/// 3.7.1.2 (Dryden).
double calc_spectrum(int axis, double x) {
  const double pole = 1.0 + x * x;
  return axis == 0 ? 4.0 / kTwoPi / pole : 2.0 / kTwoPi * (1.0 + 3.0 * x * x) / (pole * pole);
}

TEST(TurbulenceTest, HasTheScalesOfTheStandard) {
  // 3.7.3.4, in feet: h = 98.4, L_u = h / (0.177 + 0.000823 h)^1.2, σ_w = 0.1 W20.
  const DrydenParameters dryden = calc_dryden_parameters({30.0, 12.0, 1});
  const double feet = 98.4252, decay = 0.177 + 0.000823 * feet;
  EXPECT_NEAR(dryden.length[0], 0.3048 * feet / std::pow(decay, 1.2), 1e-4);
  EXPECT_EQ(dryden.length[2], 30.0);
  EXPECT_NEAR(dryden.deviation[0], 1.2 / std::pow(decay, 0.4), 1e-6);
  EXPECT_DOUBLE_EQ(dryden.deviation[2], 1.2);
}

TEST(TurbulenceTest, HasVariancesAndSpectraOfTheStandard) {
  const config::Turbulence wanted{300.0, 12.0, 1};  // where all lengths are nearly alike
  const DrydenParameters dryden = calc_dryden_parameters(wanted);
  Turbulence turbulence(wanted, {5.0, 0.0, 0.0});
  constexpr int kSamples = 1'000'000, kSegment = 2000, kBands = 4, kBins = 40;
  const double apart = 0.125 * dryden.length[2];
  Eigen::Array3d variance = Eigen::Array3d::Zero();
  std::array<Eigen::Array3d, kBands * kBins> power;
  power.fill(Eigen::Array3d::Zero());
  std::vector<Eigen::Array3d> segment(kSegment);
  const auto calc_phase = [](int bin) { return kTwoPi * (10 + bin) / kSegment; };
  for (int from = 0; from < kSamples; from += kSegment) {
    for (int k = 0; k < kSegment; ++k) {
      const Eigen::Array3d u = turbulence.at((from + k) * apart).array() / dryden.deviation.array();
      variance += u.square() / kSamples;
      segment[static_cast<std::size_t>(k)] = (1.0 - std::cos(kTwoPi * (k + 0.5) / kSegment)) * u;
    }
    for (int bin = 0; bin < kBands * kBins; ++bin) {  // Goertzel's algorithm
      const double twice = 2.0 * std::cos(calc_phase(bin));
      Eigen::Array3d last = Eigen::Array3d::Zero(), before = last;
      for (const Eigen::Array3d& u : segment) {
        const Eigen::Array3d next = u + twice * last - before;
        before = last;
        last = next;
      }
      power[static_cast<std::size_t>(bin)] +=
          last.square() + before.square() - twice * last * before;
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(variance[axis], 1.0, 0.03) << axis;
    const double unit = apart / dryden.length[axis];  // between samples, of the scale length
    for (int band = 0; band < kBands; ++band) {
      double density = 0.0, expected = 0.0;
      for (int bin = band * kBins; bin < (band + 1) * kBins; ++bin) {
        // A window of Hann has the mean square 3/2.
        density += power[static_cast<std::size_t>(bin)][axis] * 2.0 * unit / kTwoPi /
                   (1.5 * kSegment) / (kSamples / kSegment);
        expected += calc_spectrum(axis, calc_phase(bin) / unit);
      }
      EXPECT_NEAR(density / expected, 1.0, 0.03) << axis << ", band " << band;
    }
  }
}

TEST(TurbulenceTest, IsOneFieldThatTheMeanWindCarries) {
  const Vector3d wind(3.0, -4.0, 0.5), along = Vector3d(0.6, -0.8, 0.0);
  config::Plant plant;
  plant.air.v_wind_W = wind;
  plant.wind.turbulence = config::Turbulence{20.0, 8.0, 7};
  const Air air(plant), other(plant);
  const Vector3d p(10.0, 20.0, -3.0);
  const Vector3d here = air.calc_wind(2.0, p);
  EXPECT_GT((here - wind).norm(), 0.1);
  // Seven metres downwind 7 / 5 s later, and anywhere across the wind.
  EXPECT_LE((other.calc_wind(3.4, p + 7.0 * along) - here).norm(), 1e-12);
  EXPECT_LE((other.calc_wind(2.0, p + Vector3d(40.0, 30.0, 9.0)) - here).norm(), 1e-12);
  EXPECT_GT((other.calc_wind(2.0, p + 7.0 * along) - here).norm(), 0.01);
  EXPECT_EQ(
      test::find_error<std::runtime_error>([&] { air.calc_wind(0.0, 600.0 * along); }),
      "turbulence: expected bodies within 500 m of the origin along the wind, got one further "
      "away");
}

TEST(AirTest, GustsComeStayAndGo) {
  config::Plant plant;
  plant.air.v_wind_W = {1.0, 0.0, 0.0};
  plant.wind.gusts = {{1'000'000'000, 500'000'000, 2'000'000'000, {4.0, 0.0, 0.0}},
                      {2'000'000'000, 0, {}, {0.0, 2.0, 0.0}}};
  const Air air(plant);
  const auto wind = [&](double time) { return air.calc_wind(time, Vector3d::Zero()); };
  EXPECT_EQ(wind(0.5), Vector3d(1.0, 0.0, 0.0));
  EXPECT_LE((wind(1.25) - Vector3d(3.0, 0.0, 0.0)).norm(), 1e-12);
  EXPECT_LE((wind(2.5) - Vector3d(5.0, 2.0, 0.0)).norm(), 1e-12);
  EXPECT_LE((wind(3.125) - Vector3d(4.0, 2.0, 0.0)).norm(), 1e-12);
  EXPECT_EQ(wind(9.0), Vector3d(1.0, 2.0, 0.0));
}

// --- plants --------------------------------------------------------------------------------------

/// A scenario of one vehicle of a kind, as the rigid links have it.
config::Scenario make_scenario(const std::string& kind) {
  config::Scenario scenario;
  config::Plant& plant = scenario.plant;
  plant.model.name = kind.substr(0, kind.find(' '));
  const bool is_rigid = kind.find("rigid") != kind.npos;
  if (is_rigid) scenario.vehicle = {1.5, kRigidLoad.mass, kRigidLoad.distance, 9.8};
  if (plant.model.name == "slung_load")
    plant.own = SlungLoadKeys{is_rigid ? Pendulum::kRigid : Pendulum::kIdeal};
  if (plant.model.name == "cables") plant.own.edit<CablesKeys>().load_inertia.reset();
  if (plant.model.name == "multirotor") {
    auto& keys = plant.own.edit<MultirotorKeys>();
    keys.inertia = {0.03, 0.03, 0.05};
    keys.rotor.thrust_constant = 5e-6;
    keys.rotor.max_speed = 1e5;
    for (const double side : {-0.2, 0.2}) {
      keys.rotors.emplace_back();
      keys.rotors.back().position = {side, 0.0, 0.0};
    }
    if (is_rigid) {
      keys.pendulum = Pendulum::kRigid;
      keys.rod = RodKeys{kRigidRod.mass,
                         kRigidRod.distance,
                         {kRigidRod.inertia_xx, kRigidRod.inertia_yy, kRigidRod.inertia_zz}};
      keys.load_inertia = {kRigidLoad.inertia_xx, kRigidLoad.inertia_yy, kRigidLoad.inertia_zz};
    }
    scenario.autopilot.emplace();
  }
  return scenario;
}

std::unique_ptr<Plant> make(const config::Scenario& scenario) {
  return std::move(make_plants(find_plant_type(scenario.plant.model), scenario, {0}).front().plant);
}

class AirOfPlantTest : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(, AirOfPlantTest,
                         testing::Values("analytic", "cables", "slung_load", "slung_load rigid",
                                         "multirotor", "multirotor rigid"),
                         [](const auto& info) {
                           std::string name = info.param;
                           for (char& c : name)
                             if (c == ' ') c = '_';
                           return name;
                         });

TEST_P(AirOfPlantTest, ALoadInAConstantWindHangsAtTheAngleOfItsDrag) {
  // Moments about the joint: drag × length = Σ weight × arm. The force holds the whole.
  config::Scenario scenario = make_scenario(GetParam());
  config::Plant& plant = scenario.plant;
  plant.air.v_wind_W = {6.0, 0.0, 0.0};
  plant.load_drag = {0.05, 0.02, 1.2};
  const double drag = 0.05 * 6.0 + 0.5 * 1.2 * 0.02 * 36.0, g = scenario.vehicle.gravity;
  const bool is_rigid = std::string(GetParam()).find("rigid") != std::string::npos;
  const double length = scenario.vehicle.rod_length, rod = is_rigid ? kRigidRod.mass : 0.0;
  const double load = scenario.vehicle.load_mass;
  plant.initial.rod.beta =
      std::atan(drag * length / ((load * length + rod * kRigidRod.distance) * g));
  const auto moving = make(scenario);
  const std::vector<Vector3d> force = {
      Vector3d(-drag, 0.0, -(scenario.vehicle.quad_mass + load + rod) * g)};
  const Vector3d start = moving->measurement(0).p_WL;
  moving->advance(force, 2000);
  EXPECT_LE((moving->measurement(0).p_WL - start).norm(), 1e-11);
  EXPECT_LE(moving->measurement(0).v_WL.norm(), 1e-11);
  const model::Numbers& signals = moving->measurement(0).signals;
  EXPECT_EQ(moving->signals().back().name, "load_drag_z_n");
  EXPECT_NEAR(signals[signals.size() - 3], drag, 1e-11);
}

config::Scenario make_windy(const std::string& kind) {
  config::Scenario scenario = make_scenario(kind);
  config::Plant& plant = scenario.plant;
  plant.initial.position = {0.2, -0.1, -1.0};
  plant.initial.v_WQ = {0.1, 0.2, -0.1};
  plant.initial.rod = {0.3, -0.2, 0.5, 0.4};
  plant.air.v_wind_W = {2.0, -1.0, 0.3};
  plant.load_drag = {0.1, 0.03, 1.225};
  plant.wind.gusts = {{500'000'000, 1'000'000'000, 2'000'000'000, {2.0, 1.0, 0.0}}};
  plant.wind.turbulence = config::Turbulence{10.0, 6.0, 3};
  return scenario;
}

TEST(AirTest, ThePlantsAgreeInGustsAndTurbulence) {
  std::vector<std::unique_ptr<Plant>> plants;
  for (const char* kind : {"analytic", "cables", "slung_load", "multirotor"})
    plants.push_back(make(make_windy(kind)));
  double largest = 0.0;
  for (int k = 0; k < 8000; ++k) {
    const model::SlungLoadState at = plants[0]->measurement(0);
    const Vector3d force = calc_shaking_force(k * kStep, at.p_WQ, at.v_WQ, 1.7, 9.8);
    for (const auto& plant : plants) {
      plant->advance({force}, 1);
      largest = std::max(
          largest, calc_position_difference(plant->measurement(0), plants[0]->measurement(0)));
    }
  }
  EXPECT_LE(largest, 1e-9);
  const auto wind = [&](std::size_t i) -> Vector3d {
    const model::Numbers& signals = plants[i]->measurement(0).signals;
    return signals.segment<3>(signals.size() - 6);
  };
  EXPECT_GT((wind(0) - Vector3d(2.0, -1.0, 0.3)).norm(), 0.1);
  for (std::size_t i = 1; i < plants.size(); ++i) EXPECT_LE((wind(i) - wind(0)).norm(), 1e-7);
}

TEST_P(AirOfPlantTest, SplitsStepsWithTheSameBits) {
  const auto at_once = make(make_windy(GetParam())), in_parts = make(make_windy(GetParam()));
  for (int period = 0; period < 50; ++period) {
    const std::vector<Vector3d> force = {Vector3d(0.01 * period, -0.3, -16.0)};
    at_once->advance(force, 7);
    for (const int steps : {2, 0, 4, 1}) in_parts->advance(force, steps);
    ASSERT_EQ(at_once->measurement(0).p_WL, in_parts->measurement(0).p_WL);
    ASSERT_EQ(at_once->measurement(0).signals, in_parts->measurement(0).signals);
  }
}

TEST(AirTest, DragKeepsTheOrderFourAndAWindThatChangesHasTwo) {
  for (const bool has_gust : {false, true}) {
    const auto fly = [&](std::int64_t step_ns) {
      config::Scenario scenario = make_windy("analytic");
      scenario.plant.step_ns = step_ns;
      scenario.plant.wind.turbulence.reset();
      if (!has_gust) scenario.plant.wind.gusts.clear();
      const auto plant = make(scenario);
      plant->advance({Vector3d(0.4, 0.3, -16.0)}, 2'000'000'000 / step_ns);
      return model::SlungLoadState(plant->measurement(0));
    };
    const model::SlungLoadState fine = fly(500'000);
    const double ratio = calc_position_difference(fly(20'000'000), fine) /
                         calc_position_difference(fly(10'000'000), fine);
    EXPECT_NEAR(std::log2(ratio), has_gust ? 2.0 : 4.0, 0.2);
  }
}

}  // namespace
}  // namespace sls::sim
