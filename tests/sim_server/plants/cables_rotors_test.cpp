// Vehicles of the plant `cables` with rotors and an autopilot.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include "sim_server/autopilots/autopilot.hpp"
#include "sim_server/autopilots/geometric/keys.hpp"
#include "sim_server/plants/cables/cables_plant.hpp"
#include "sim_server/plants/multirotor/keys.hpp"
#include "sim_server/plants/multirotor/multirotor_plant.hpp"
#include "tests/sim_server/plants/plant_flights.hpp"
#include "tests/sim_server/plants/signals.hpp"

namespace sls::sim {
namespace {

using Eigen::Quaterniond, Eigen::Vector3d;

constexpr double kGravity = 9.8, kThrustConstant = 5e-6;
constexpr double kWithoutLimit = 1e5;  // rad/s: above every set-point of these tests

/// A quadrotor in X without lag, losses and limits.
AirframeKeys make_ideal_airframe() {
  AirframeKeys keys;
  keys.inertia = {0.029, 0.031, 0.055};
  keys.rotor.thrust_constant = kThrustConstant;
  keys.rotor.torque_constant = 0.05;
  keys.rotor.max_speed = kWithoutLimit;
  for (const auto& [x, y, spin] :
       {std::tuple{0.13, 0.22, Spin::kCounterClockwise},
        std::tuple{-0.13, -0.20, Spin::kCounterClockwise},
        std::tuple{0.13, -0.22, Spin::kClockwise}, std::tuple{-0.13, 0.20, Spin::kClockwise}}) {
    RotorKeys rotor;
    rotor.position = {x, y, 0.0};
    rotor.spin = spin;
    keys.rotors.push_back(rotor);
  }
  return keys;
}

/// All that rotors can have.
AirframeKeys make_full_airframe() {
  AirframeKeys keys = make_ideal_airframe();
  keys.products = {0.001, -0.002, 0.0005};
  keys.rotor.max_speed = 1300.0;
  keys.rotor.lag_up = 0.05;
  keys.rotor.lag_down = 0.08;
  keys.rotor.thrust_loss_speed = 25.0;
  keys.rotor.drag_constant = 2e-4;
  keys.rotor.rolling_constant = 1e-6;
  keys.rotors[1].axis = {0.02, 0.01, -1.0};
  keys.rotors[2].own.thrust_constant = 5.2e-6;
  keys.disturbance_torque = {0.002, -0.001, 0.001};
  return keys;
}

/// A vehicle of 1.5 kg at the origin, its load of 0.2 kg on 1 m.
PlantSetup make_setup(const std::optional<AirframeKeys>& airframe) {
  PlantSetup setup;
  CablesKeys keys;
  keys.airframe = airframe;
  setup.plant.own = keys;
  setup.vehicles.resize(1);
  setup.vehicles[0].initial.placed = config::Body::kQuadrotor;
  return setup;
}

/// The force that holds a vehicle of the triangle and brings it back to `p`.
Vector3d calc_holding_force(std::size_t vehicle, const model::Measurement& at, const Vector3d& p) {
  const double at_ring = 2.0 * M_PI / 3.0 * static_cast<double>(vehicle);
  const double share = 0.2 * kGravity;
  return Vector3d(share * std::tan(0.3) * std::cos(at_ring),
                  share * std::tan(0.3) * std::sin(at_ring), -1.7 * kGravity) -
         2.0 * (at.p_WQ - p) - 2.0 * at.v_WQ;
}

/// Three vehicles over the corners of a triangle of 0.6 kg, whose centre is at the origin. Their
/// cables lean outwards by 0.3 rad, and bodies as far as the thrust that holds them.
PlantSetup make_triangle(const std::optional<AirframeKeys>& airframe) {
  PlantSetup setup = make_setup(airframe);
  auto& keys = setup.plant.own.edit<CablesKeys>();
  keys.load_inertia = Vector3d(0.01, 0.01, 0.02);
  setup.vehicles.resize(3);
  for (std::uint32_t i = 0; i < 3; ++i) {
    const double at = 2.0 * M_PI / 3.0 * i;
    const Vector3d out(std::cos(at), std::sin(at), 0.0),
        n = {-std::sin(0.3) * out.x(), -std::sin(0.3) * out.y(), std::cos(0.3)};
    CableKeys cable;
    cable.attachment = 0.3 * out;
    const model::RodAngles angles = model::to_angles({n, Vector3d::Zero()});
    cable.alpha = angles.alpha;
    cable.beta = angles.beta;
    keys.cables.push_back(cable);
    setup.vehicles[i].id = i;
    setup.vehicles[i].initial.placed = config::Body::kLoad;
    setup.vehicles[i].initial.position = cable.attachment;
    if (airframe)
      setup.vehicles[i].initial.q_WB =
          calc_attitude_for(calc_holding_force(i, model::Measurement(), Vector3d::Zero()));
  }
  return setup;
}

PlantSetup with_geometric(PlantSetup setup, double rate, std::int64_t period_ns) {
  const double inertia = 0.04;
  setup.autopilot.model.name = "geometric";
  setup.autopilot.own = geometric::Keys{inertia * rate * rate, 2.0 * inertia * rate};
  setup.autopilot.period_ns = period_ns;
  return setup;
}

double calc_difference(const model::Measurement& a, const model::Measurement& b) {
  return std::max((a.p_WQ - b.p_WQ).norm(), (a.p_WL - b.p_WL).norm());
}

TEST(CablesRotorsTest, ATautVehicleIsThatOfTheMultirotor) {
  // Two formulations: joint coordinates of a pendulum, and a constraint between two bodies. The air
  // always meets the hubs from above: if its direction reverses, the slope of the thrust jumps.
  PlantSetup setup = with_geometric(make_setup(make_full_airframe()), 15.0, 4'000'000);
  setup.plant.step_ns = 500'000;
  setup.plant.disturbance_W = {0.1, -0.2, 0.15};
  setup.plant.air.v_wind_W = {1.0, -0.5, 12.0};
  config::InitialState& initial = setup.vehicles[0].initial;
  initial.position = {0.2, -0.3, -1.0};
  initial.v_WQ = {0.3, -0.2, 0.1};
  initial.rod = {0.4, -0.3, 0.6, -0.5};
  initial.q_WB = Quaterniond(0.95, 0.2, -0.1, 0.15).normalized();
  initial.w_WB_B = Vector3d(0.3, -0.4, 0.2);
  CablesPlant cables(setup);
  MultirotorKeys keys;
  static_cast<AirframeKeys&>(keys) = make_full_airframe();
  setup.plant.own = keys;
  MultirotorPlant multirotor(setup);
  double largest = 0.0, turn = 0.0, tension = 0.0, rotors = 0.0, tilt = 0.0;
  for (int k = 0; k < 8000; ++k) {
    const model::Measurement& at = multirotor.measurement(0);
    const std::vector<Vector3d> force = {
        calc_shaking_force(0.001 * k, at.p_WQ, at.v_WQ, 1.7, kGravity)};
    cables.advance(force, 2);
    multirotor.advance(force, 2);
    const model::Measurement &one = cables.measurement(0), &other = multirotor.measurement(0);
    largest = std::max(largest, calc_difference(one, other));
    turn = std::max(turn, one.attitude.q_WB.angularDistance(other.attitude.q_WB));
    tension = std::max(tension, std::abs(one.signals[0] - other.signals[14]));
    for (int i = 0; i < 14; ++i)
      rotors = std::max(rotors, std::abs(one.signals[10 + i] - other.signals[i]));
    tilt = std::max(tilt, calc_tilt(other.attitude.q_WB * Vector3d::UnitZ()));
    ASSERT_EQ(one.signals[2], 1.0) << "slack at " << k;
  }
  EXPECT_GT(tilt, 0.3);
  EXPECT_LE(largest, 1e-9);
  EXPECT_LE(turn, 1e-9);
  EXPECT_LE(tension, 1e-8);
  EXPECT_LE(rotors, 1e-5);  // of 900 rad/s
  RecordProperty("position_fm", std::to_string(largest * 1e15));
  RecordProperty("turn_prad", std::to_string(turn * 1e12));
}

TEST(CablesRotorsTest, IdealRotorsWithoutAutopilotAreThePointMassesThroughEveryEvent) {
  const auto fly = [](const std::optional<AirframeKeys>& airframe) {
    PlantSetup setup = make_triangle(airframe);
    auto& keys = setup.plant.own.edit<CablesKeys>();
    keys.ground_z = 0.2;
    keys.cables[1].distance = 0.8;
    keys.cables[2].release_ns = 1'500'300'000;
    return CablesPlant(setup);
  };
  CablesPlant points = fly({}), bodies = fly(make_ideal_airframe());
  std::size_t remarks = 0;
  for (int k = 0; k < 2500; ++k) {
    std::vector<Vector3d> forces;
    for (std::size_t i = 0; i < 3; ++i) {
      const double t = 0.001 * k;
      forces.push_back(calc_holding_force(i, points.measurement(i), Vector3d(0.0, 0.0, -1.0)) +
                       Vector3d(0.0, 0.0, 6.0 * std::sin(5.0 * t + static_cast<double>(i))));
    }
    points.advance(forces, 1);
    bodies.advance(forces, 1);
    for (std::size_t i = 0; i < 3; ++i) {
      ASSERT_LE(calc_difference(points.measurement(i), bodies.measurement(i)), 1e-10) << k;
      const std::vector<std::string> said = points.take_remarks(i);
      const std::vector<std::string> also = bodies.take_remarks(i);
      ASSERT_EQ(said.size(), also.size()) << k;
      for (std::size_t r = 0; r < said.size(); ++r)
        ASSERT_EQ(said[r].substr(0, 12), also[r].substr(0, 12)) << said[r];
      remarks += said.size();
    }
  }
  EXPECT_GT(remarks, 6u);
}

TEST(CablesRotorsTest, ComesToThePointMassesWithTheFirstOrderOfAttitudeLoopAndLags) {
  const auto fly_with_rate = [](double rate) {  // of the attitude loop, rad/s
    AirframeKeys airframe = make_ideal_airframe();
    airframe.rotor.lag_up = airframe.rotor.lag_down = 0.2 / rate;
    PlantSetup setup = with_geometric(make_triangle(airframe), rate, 250'000);
    setup.plant.step_ns = 250'000;
    CablesPlant bodies(setup);
    CablesPlant points(make_triangle({}));
    double largest = 0.0;
    for (int k = 0; k < 4000; ++k) {
      std::vector<Vector3d> forces;
      for (std::size_t i = 0; i < 3; ++i) {
        const model::Measurement& at = points.measurement(i);
        const double t = 0.001 * k, ring = 2.0 * M_PI / 3.0 * static_cast<double>(i);
        const Vector3d place(0.5955 * std::cos(ring), 0.5955 * std::sin(ring), -0.9553);
        // Grows from nothing, so that no attitude has to jump.
        forces.push_back(calc_holding_force(i, at, place) +
                         std::min(t, 1.0) * Vector3d(2.0 * std::sin(2.9 * t), std::sin(2.6 * t),
                                                     2.0 * std::sin(1.3 * t)));
      }
      points.advance(forces, 1);
      bodies.advance(forces, 4);
      for (std::size_t i = 0; i < 3; ++i)
        largest = std::max(largest, calc_difference(points.measurement(i), bodies.measurement(i)));
    }
    return largest;
  };
  const double at_40 = fly_with_rate(40.0), at_80 = fly_with_rate(80.0);
  EXPECT_LE(at_80, 0.1);
  EXPECT_NEAR(std::log2(at_40 / at_80), 1.0, 0.2) << at_40;
  RecordProperty("distance_at_40_m", std::to_string(at_40));
  RecordProperty("distance_at_80_m", std::to_string(at_80));
}

TEST(CablesRotorsTest, HangsALoadInTheTiltAndAtTheSpeedsOfStatics) {
  // Each vehicle pulls outwards: T cos 0.3 = m_L g / 3, and its thrust is m g up and T along n.
  AirframeKeys airframe = make_ideal_airframe();
  airframe.rotor.lag_up = airframe.rotor.lag_down = 0.02;
  PlantSetup setup = with_geometric(make_triangle(airframe), 30.0, 2'000'000);
  CablesPlant plant(setup);
  std::vector<Vector3d> places;
  for (std::size_t i = 0; i < 3; ++i) places.push_back(plant.measurement(i).p_WQ);
  for (int k = 0; k < 30'000; ++k) {
    std::vector<Vector3d> forces;
    for (std::size_t i = 0; i < 3; ++i)
      forces.push_back(calc_holding_force(i, plant.measurement(i), places[i]));
    plant.advance(forces, 1);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    model::Measurement rest;
    rest.p_WQ = places[i];
    const Vector3d force = calc_holding_force(i, rest, places[i]);
    const model::Measurement& at = plant.measurement(i);
    EXPECT_LE((at.p_WQ - places[i]).norm(), 1e-6);
    EXPECT_LE(at.attitude.q_WB.angularDistance(calc_attitude_for(force)), 1e-6);
    EXPECT_NEAR(find(plant, i, "cable_tension_n"), 0.2 * kGravity / std::cos(0.3), 1e-5);
    EXPECT_NEAR(find(plant, i, "thrust_n"), force.norm(), 1e-5);
    for (int rotor = 1; rotor <= 4; ++rotor)
      EXPECT_NEAR(find(plant, i, "rotor_" + std::to_string(rotor) + "_rad_s"),
                  std::sqrt(force.norm() / 4.0 / kThrustConstant), 1e-4);
  }
}

TEST(CablesRotorsTest, ConvergesWithTheFourthOrderAwayFromEventsAndAcrossThem) {
  const auto fly = [](std::int64_t step_ns, bool has_events) {
    AirframeKeys airframe = make_full_airframe();
    airframe.rotor.max_speed = kWithoutLimit;
    PlantSetup setup = with_geometric(make_triangle(airframe), 10.0, 20'000'000);
    setup.plant.step_ns = step_ns;
    setup.plant.air.v_wind_W = {1.0, -0.5, 12.0};  // no hub meets the air from below
    if (has_events) setup.plant.own.edit<CablesKeys>().cables[1].distance = 0.95;
    CablesPlant plant(setup);
    std::size_t remarks = 0;
    for (int k = 0; k < 40; ++k) {
      std::vector<Vector3d> forces;
      for (std::size_t i = 0; i < 3; ++i)
        forces.push_back(1.9 * calc_holding_force(i, model::Measurement(), Vector3d::Zero()) +
                         Vector3d(std::sin(0.3 * k), std::cos(0.2 * k), 0.0));
      plant.advance(forces, 20'000'000 / step_ns);
      for (std::size_t i = 0; i < 3; ++i) remarks += plant.take_remarks(i).size();
    }
    EXPECT_EQ(remarks > 0, has_events);
    Eigen::Matrix<double, 10, 1> end;
    const model::Measurement& at = plant.measurement(1);
    end << at.p_WQ, at.p_WL, at.attitude.q_WB.coeffs();
    return end;
  };
  for (const bool has_events : {false, true}) {
    const auto fine = fly(625'000, has_events);
    const double at_10 = (fly(10'000'000, has_events) - fine).norm();
    const double at_5 = (fly(5'000'000, has_events) - fine).norm();
    // Where an event falls within a step changes the error by a factor, not its order.
    EXPECT_NEAR(std::log2(at_10 / at_5), 4.0, has_events ? 1.0 : 0.3) << at_10;
    RecordProperty(has_events ? "order_across_events" : "order",
                   std::to_string(std::log2(at_10 / at_5)));
  }
}

/// The time in the remark that begins with `text`, s.
double find_time(Plant& plant, const std::string& text) {
  for (const std::string& remark : plant.take_remarks(0))
    if (remark.rfind(text + " at ", 0) == 0) return std::stod(remark.substr(text.size() + 4));
  return std::nan("");
}

TEST(CablesRotorsTest, LagsOfRotorsPlaceEventsInsideAStepWhereTheClosedFormHasThem) {
  // The load stands, the cable is taut. The thrust c w² of lagging rotors crosses the weight of
  // both, then the load lifts off; or that of the vehicle, then the cable goes slack.
  const auto fly = [](double last_force, const std::string& event) {
    AirframeKeys airframe = make_ideal_airframe();
    airframe.rotor.lag_up = 0.05;
    airframe.rotor.lag_down = 0.08;
    PlantSetup setup = make_setup(airframe);
    setup.plant.own.edit<CablesKeys>().ground_z = 1.0;
    CablesPlant plant(setup);
    const auto calc_speed = [](double force) { return std::sqrt(force / 4.0 / kThrustConstant); };
    const double standing = calc_speed(1.6 * kGravity), start = calc_speed(1.7 * kGravity);
    plant.advance({Vector3d(0.0, 0.0, -1.6 * kGravity)}, 200);
    EXPECT_TRUE(plant.take_remarks(0).empty());
    plant.advance({Vector3d(0.0, 0.0, -last_force)}, 100);
    const double begun = standing + (start - standing) * std::exp(-0.2 / 0.08);
    const double last = calc_speed(last_force);
    const bool rises = last > begun;
    const double limit = calc_speed((rises ? 1.7 : 1.5) * kGravity);
    const double wanted = 0.2 + (rises ? 0.05 : 0.08) * std::log((begun - last) / (limit - last));
    EXPECT_NEAR(find_time(plant, event), wanted, 1e-9);
  };
  fly(2.0 * kGravity, "load lifts off");
  fly(1.2 * kGravity, "cable slack");
}

TEST(CablesRotorsTest, AVehicleThatStandsKeepsItsAttitudeBitForBit) {
  AirframeKeys airframe = make_ideal_airframe();
  airframe.rotor.lag_up = 0.05;
  // A slow attitude loop, whose moments do not ask for more thrust than the force.
  PlantSetup setup = with_geometric(make_setup(airframe), 5.0, 4'000'000);
  auto& keys = setup.plant.own.edit<CablesKeys>();
  keys.ground_z = 0.0;
  keys.cables.resize(1);
  keys.cables[0].distance = 0.5;
  keys.cables[0].alpha = M_PI / 2.0;
  config::InitialState& initial = setup.vehicles[0].initial;
  initial.q_WB = Quaterniond(0.99, 0.05, -0.1, 0.15).normalized();
  CablesPlant plant(setup);
  EXPECT_EQ(find(plant, 0, "rotor_1_rad_s"), 0.0);
  plant.advance({Vector3d(4.0, -2.0, -14.0)}, 500);
  const model::Measurement& at = plant.measurement(0);
  EXPECT_EQ(find(plant, 0, "vehicle_on_ground"), 1.0);
  EXPECT_GT(find(plant, 0, "thrust_n"), 13.0);
  EXPECT_EQ(at.p_WQ, Vector3d::Zero());
  EXPECT_EQ(at.attitude.q_WB.coeffs(), initial.q_WB->coeffs());
  EXPECT_EQ(at.attitude.w_WB_B, Vector3d::Zero());
  plant.advance({Vector3d(1.0, 0.0, -20.0)}, 300);
  EXPECT_EQ(find(plant, 0, "vehicle_on_ground"), 0.0);
  EXPECT_GT(at.attitude.q_WB.angularDistance(*initial.q_WB), 0.05);
  // Down again: it stops turning where it touches.
  plant.advance({Vector3d(1.0, 0.5, -1.0)}, 2000);
  EXPECT_EQ(find(plant, 0, "vehicle_on_ground"), 1.0);
  EXPECT_EQ(at.attitude.w_WB_B, Vector3d::Zero());
}

TEST(CablesRotorsTest, AFreeBodyKeepsItsAngularMomentumThroughAnImpactOfItsCable) {
  PlantSetup setup = make_setup(make_ideal_airframe());
  setup.plant.own.edit<CablesKeys>().cables.resize(1);
  setup.plant.own.edit<CablesKeys>().cables[0].distance = 0.7;
  setup.vehicles[0].initial.w_WB_B = Vector3d(3.0, -2.0, 1.0);
  CablesPlant plant(setup);
  const Vector3d inertia(0.029, 0.031, 0.055);
  const auto calc_momentum = [&] {
    const model::Attitude& attitude = plant.measurement(0).attitude;
    return Vector3d(attitude.q_WB * inertia.cwiseProduct(attitude.w_WB_B));
  };
  const Vector3d start = calc_momentum();
  plant.advance({Vector3d(0.0, 0.0, -5.0)}, 3000);  // `none`: the thrust turns nothing
  EXPECT_FALSE(std::isnan(find_time(plant, "cable taut")));
  EXPECT_LE((calc_momentum() - start).norm(), 1e-10 * start.norm());
  EXPECT_GT(plant.measurement(0).attitude.q_WB.angularDistance(Quaterniond::Identity()), 0.1);
}

TEST(CablesRotorsTest, AdvancesInAnyNumberOfCallsWithTheSameBits) {
  const auto make = [] {
    PlantSetup setup = with_geometric(make_triangle(make_full_airframe()), 15.0, 4'000'000);
    setup.plant.own.edit<CablesKeys>().cables[0].distance = 0.6;
    return CablesPlant(setup);
  };
  CablesPlant at_once = make(), in_parts = make();
  for (int period = 0; period < 60; ++period) {
    std::vector<Vector3d> forces;
    for (std::size_t i = 0; i < 3; ++i)
      forces.push_back(Vector3d(0.01 * period, -0.3, period % 9 < 3 ? -8.0 : -22.0));
    at_once.advance(forces, 7);
    for (const int steps : {2, 0, 4, 1}) in_parts.advance(forces, steps);
    for (std::size_t i = 0; i < 3; ++i) {
      const model::Measurement &a = at_once.measurement(i), &b = in_parts.measurement(i);
      ASSERT_EQ(a.p_WQ, b.p_WQ) << period;
      ASSERT_EQ(a.attitude.q_WB.coeffs(), b.attitude.q_WB.coeffs()) << period;
      ASSERT_EQ(a.signals, b.signals) << period;
      ASSERT_EQ(at_once.take_remarks(i), in_parts.take_remarks(i)) << period;
    }
  }
}

TEST(CablesRotorsTest, SaysWhichVehicleHasARotorAtItsLargestSpeed) {
  AirframeKeys airframe = make_ideal_airframe();
  airframe.rotor.max_speed = 1000.0;
  CablesPlant plant(make_triangle(airframe));
  EXPECT_TRUE(plant.has_attitude());
  EXPECT_EQ(plant.signals().size(), 10u + 14u);
  const Vector3d hover(0.0, 0.0, -16.0);
  plant.advance({hover, Vector3d(0.0, 0.0, -30.0), hover}, 1100);
  const std::vector<std::string> said = plant.take_remarks(1);
  EXPECT_EQ(std::count(said.begin(), said.end(),
                       "rotor 1 at its largest speed (1000 rad/s) for more than 1 s, since 0 s"),
            1);
  for (const std::string& remark : plant.take_remarks(0))
    EXPECT_EQ(remark.find("rotor"), std::string::npos) << remark;
}

}  // namespace
}  // namespace sls::sim
