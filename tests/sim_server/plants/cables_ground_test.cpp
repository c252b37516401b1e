// Loads and vehicles that stand on the ground, touch it and lift off, against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "tests/sim_server/plants/cables_flights.hpp"
#include "tests/sim_server/plants/cables_oracle.hpp"
#include "tests/support/errors.hpp"

namespace sls::sim::cables {
namespace {

using Kind = Event::Kind;
const Vector3d kHover(0.0, 0.0, -1.5 * 9.8);

/// The ground at z = 0, where the load of make_motion() stands.
System make_ground(std::size_t count = 1) {
  System system = make_system(count);
  system.ground_z_W = 0.0;
  return system;
}

/// The vehicle straight above the load.
Motion make_above(double distance) {
  Motion motion = make_motion();
  motion.vehicles[0].p_W = {0.0, 0.0, -distance};
  return motion;
}

TEST(CablesGroundTest, AFallingBodyStopsOnTheGroundAtTheClosedFormsTime) {
  const double fall = std::sqrt(2.0 * 0.7 / 9.8);
  for (const bool is_load : {true, false}) {
    Motion start = make_motion();
    Vehicle& vehicle = start.vehicles[0];
    vehicle.length = 5.0;
    (is_load ? start.p_WL : vehicle.p_W) = {0.1, -0.2, -0.7};
    (is_load ? start.v_WL : vehicle.v_W) = {0.3, 0.0, 0.0};
    if (is_load) vehicle.p_W.z() = -2.0;
    Flight flight(make_ground(), start);
    flight.fly(make_actions(is_load ? kHover : Vector3d(0.0, 0.0, 0.0)), 0.5);
    expect(flight.happened, {{fall, Kind::kTouchDown}}, 1e-9);
    EXPECT_EQ(flight.happened[0].cable, is_load ? kLoad : 0);
    note(is_load ? "error_of_load_s" : "error_of_vehicle_s", flight.happened[0].time - fall);
    EXPECT_EQ(flight.motion.standing().size(), is_load ? 1u : 2u);
    const Motion& end = flight.motion.motion();
    const Vector3d p = is_load ? end.p_WL : end.vehicles[0].p_W,
                   v = is_load ? end.v_WL : end.vehicles[0].v_W;
    EXPECT_EQ(p.z(), 0.0);
    EXPECT_EQ(v, Vector3d(0.0, 0.0, 0.0));
    EXPECT_NEAR(p.x(), 0.1 + 0.3 * fall, 1e-12);
    flight.fly(make_actions(is_load ? kHover : Vector3d(0.0, 0.0, 0.0)), 0.5);
    EXPECT_EQ(p, is_load ? flight.motion.motion().p_WL : flight.motion.motion().vehicles[0].p_W);
  }
}

TEST(CablesGroundTest, AVehicleStandsUntilItsForceExceedsItsWeight) {
  System system = make_ground();
  Motion start = make_motion();
  start.vehicles[0].p_W = {0.5, 0.0, 0.0};
  Flight flight(system, start);
  flight.fly(make_actions({3.0, 0.0, -1.5 * 9.8}), 0.5);  // no friction is modelled: it holds
  EXPECT_TRUE(flight.happened.empty());
  EXPECT_EQ(flight.motion.motion().vehicles[0].p_W, start.vehicles[0].p_W);
  flight.fly(make_actions({3.0, 0.0, -1.5 * 9.9}), 0.5);
  expect(flight.happened, {{0.5, Kind::kLiftOff}}, 1e-12);
  const Vector3d rise(0.125 * 2.0, 0.0, -0.125 * 0.1);
  EXPECT_LE((flight.motion.motion().vehicles[0].p_W - start.vehicles[0].p_W - rise).norm(), 1e-13);
}

TEST(CablesGroundTest, ALoadLiftsOffInTheStepWhoseForceCarriesIt) {
  // A ramp of the force, held over each step: 2 kg need more than 19.6 N.
  Flight flight(make_ground(), make_above(1.0));
  for (int k = 0; k < 1000; ++k) {
    const double force = 19.1 + 0.001 * k;
    flight.fly(make_actions({0.0, 0.0, -force}), 0.001);
    if (force < 19.6) {
      ASSERT_NEAR(flight.motion.tension()[0], force - 1.5 * 9.8, 1e-12);
      ASSERT_EQ(flight.motion.motion().p_WL, Vector3d(0.0, 0.0, 0.0));
    }
  }
  // At 19.6 N rounding decides.
  ASSERT_EQ(flight.happened.size(), 1u);
  EXPECT_EQ(flight.happened[0].kind, Kind::kLiftOff);
  EXPECT_EQ(flight.happened[0].cable, kLoad);
  EXPECT_NEAR(flight.happened[0].time, 0.5, 0.0011);
  EXPECT_LT(flight.motion.motion().p_WL.z(), 0.0);
}

TEST(CablesGroundTest, ALoadLiftsOffInsideAStepWhenTheForcesOfAnOrbitExceedItsWeight) {
  // The vehicle hovers and circles the standing load on its cable: λ = m v²/l − … of a load set
  // free is μ (v²/l + g c), c the cosine of the cable's angle, and lifts m_L g where
  // g c² + v²/l c = g (1 + m_L/m).
  const double speed = 2.0, from = 1.0;
  const double c = (-4.0 + std::sqrt(16.0 + 4.0 * 9.8 * 9.8 * (1.0 + 0.5 / 1.5))) / (2.0 * 9.8);
  const double lift_off = (from - std::acos(c)) / speed;
  Motion start = make_motion();
  start.vehicles[0].p_W = {-std::sin(from), 0.0, -std::cos(from)};
  start.vehicles[0].v_W = speed * Vector3d(std::cos(from), 0.0, -std::sin(from));
  Flight flight(make_ground(), start);
  flight.fly(make_actions(kHover), std::floor(lift_off * 1000.0) * 0.001);
  EXPECT_TRUE(flight.happened.empty());
  EXPECT_EQ(flight.motion.motion().p_WL, Vector3d(0.0, 0.0, 0.0));
  flight.fly(make_actions(kHover), 0.02);
  expect(flight.happened, {{lift_off, Kind::kLiftOff}}, 1e-9);
  note("error_s", flight.happened[0].time - lift_off);
  EXPECT_LT(flight.motion.motion().p_WL.z(), 0.0);
}

TEST(CablesGroundTest, AWinchTakesAStandingLoadAlongInAnImpact) {
  // 0.2 m of slack are reeled in after √(2 · 0.2 / a); load and vehicle approach by l̇ = −a t.
  const double a = 0.5, arrival = std::sqrt(0.4 / a);
  Flight flight(make_ground(), make_above(0.8));
  Actions actions = make_actions({0.0, 0.0, -2.0 * 9.8});
  actions.f_Q_W[0] = kHover;
  actions.length_acceleration[0] = -a;
  flight.fly(actions, 0.895);
  expect(flight.happened, {{arrival, Kind::kTaut}, {arrival, Kind::kLiftOff}}, 1e-9);
  const double impulse = 1.5 * 0.5 / 2.0 * a * arrival;
  EXPECT_NEAR(flight.happened[0].impulse, impulse, 1e-9);
  // Gravity on the load alone is 4.9 N; μ (g − l̈) is the tension.
  const double after = 0.895 - arrival, tension = 1.5 * 0.5 / 2.0 * (9.8 + a);
  EXPECT_NEAR(flight.motion.motion().v_WL.z(), -impulse / 0.5 + (9.8 - tension / 0.5) * after,
              1e-9);
}

TEST(CablesGroundTest, ACableThatBecomesTautTearsTheLoadOffAndKeepsTheMomentum) {
  for (const bool is_plate : {false, true}) {
    System system = is_plate ? make_plate(1) : make_ground();
    system.attachment_L[0].setZero();
    system.ground_z_W = 0.0;
    Motion start = make_above(0.4);
    start.vehicles[0].v_W = {0.0, 0.0, -2.0};
    Flight flight(system, start);
    flight.fly(make_actions(kHover), 0.301);
    expect(flight.happened, {{0.3, Kind::kTaut}, {0.3, Kind::kLiftOff}}, 1e-9);
    const double common = -2.0 * 1.5 / 2.0, gravity = 9.8 * 0.5 / 2.0;
    EXPECT_NEAR(flight.motion.motion().v_WL.z(), common + gravity * 0.001, 1e-9);
    EXPECT_NEAR(flight.motion.motion().vehicles[0].v_W.z(), common + gravity * 0.001, 1e-9);
  }
}

TEST(CablesGroundTest, ATouchDownThatTautensTheCableEndsOnTheGroundOrWithItsPull) {
  // The load falls at 1 m/s, the vehicle rises at u; at the ground the cable reaches its length.
  // The ground stops the load if it has more momentum than the cable takes: m u < m_L v.
  for (const double u : {0.2, 0.5}) {
    System system = make_ground();
    system.gravity = 0.0;  // so that the speeds stay
    Motion start = make_above(1.0 - u * 0.1);
    start.p_WL.z() = -0.1;
    start.v_WL.z() = 1.0;
    start.vehicles[0].v_W.z() = -u;
    Flight flight(system, start);
    flight.fly(make_actions({0.0, 0.0, 0.0}), 0.099);
    ASSERT_TRUE(flight.happened.empty());
    flight.fly(make_actions({0.0, 0.0, 0.0}), 0.002);
    const Motion& end = flight.motion.motion();
    const bool stands = u < 0.5 / 1.5;
    EXPECT_EQ(flight.motion.standing().size(), stands ? 1u : 0u);
    const double common = stands ? 0.0 : (0.5 - 1.5 * u) / 2.0;
    EXPECT_NEAR(end.v_WL.z(), common, 1e-12);
    EXPECT_NEAR(end.vehicles[0].v_W.z(), common, 1e-12);
    EXPECT_NEAR(flight.happened.at(0).impulse, 1.5 * (common + u), 1e-12);
  }
}

TEST(CablesGroundTest, AStandingLoadStaysBitForBitWhileVehiclesPullAtIt) {
  System system = make_plate(3);
  system.ground_z_W = 0.25;
  Motion start = make_ring(system, 0.5);
  start.q_WL = Eigen::Vector4d(0.3, -0.2, 0.1, 0.9).normalized();
  start.p_WL = {0.1, 0.7, 0.25};
  const Eigen::Matrix3d R = oracle::to_rotation(start);
  for (std::size_t i = 0; i < 3; ++i)
    start.vehicles[i].p_W += start.p_WL + R * system.attachment_L[i] - system.attachment_L[i];
  Flight flight(system, start);
  Actions actions = make_actions(kHover);
  for (int k = 0; k < 2000; ++k) {
    for (std::size_t i = 0; i < 3; ++i)
      actions.f_Q_W[i] = kHover + Vector3d(0.1 * std::sin(0.01 * k), 0.05, -1.0);
    flight.fly(actions, 0.001);
    const Motion& motion = flight.motion.motion();
    ASSERT_EQ(motion.p_WL, start.p_WL) << k;
    ASSERT_EQ(motion.q_WL, start.q_WL) << k;
    ASSERT_EQ(motion.v_WL, Vector3d(0.0, 0.0, 0.0)) << k;
    ASSERT_EQ(flight.motion.taut().size(), 3u) << k;
  }
  EXPECT_GT((flight.motion.motion().vehicles[0].p_W - start.vehicles[0].p_W).norm(), 0.1);
}

TEST(CablesGroundTest, NothingSinksAndNoEnergyAppearsInRandomFlights) {
  // Constant forces over a step work f · Δx; what ground and cables do only takes energy away.
  std::mt19937 random(6);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  std::size_t touched = 0, lifted = 0;
  double most = 0.0;
  for (int run = 0; run < 24; ++run) {
    const auto count = 1 + static_cast<std::size_t>(run % 6);
    oracle::Scene scene = oracle::make_scene(random, count, run % 4 < 2, false);
    System& system = scene.system;
    system.restitution = run % 3 == 0 ? 0.5 : 0.0;
    double lowest = scene.motion.p_WL.z();
    for (std::size_t i = 0; i < count; ++i) {
      scene.motion.vehicles[i].length_rate = 0.0;
      lowest = std::max(lowest, scene.motion.vehicles[i].p_W.z());
    }
    system.ground_z_W = lowest + 0.3;
    HybridMotion motion(system, scene.motion);
    double mass = system.load_mass;
    for (std::size_t i = 0; i < count; ++i) mass += system.vehicle_mass[i];
    std::vector<Event> events;
    Actions actions;
    for (int k = 0; k < 2000; ++k) {
      const Motion before = motion.motion();
      if (k % 20 == 0)
        for (std::size_t i = 0; i < count; ++i) {
          const Vehicle& vehicle = before.vehicles[i];
          const double up = k % 1000 < 500 ? 1.2 : 0.5;
          actions.f_Q_W[i] = 3.0 * Vector3d(any(random), any(random), any(random)) -
                             0.5 * (vehicle.v_W + vehicle.p_W) -
                             Vector3d(0.0, 0.0, up * 9.8 * mass / static_cast<double>(count));
        }
      events.clear();
      motion.step(actions, 0.001, events);
      const Motion& after = motion.motion();
      double work = 0.0;
      for (std::size_t i = 0; i < count; ++i) {
        work += actions.f_Q_W[i].dot(after.vehicles[i].p_W - before.vehicles[i].p_W);
        ASSERT_LE(after.vehicles[i].p_W.z(), *system.ground_z_W + 1e-11) << run << ' ' << k;
      }
      ASSERT_LE(after.p_WL.z(), *system.ground_z_W + 1e-11) << run << ' ' << k;
      const double gained = calc_energy(system, after) - calc_energy(system, before) - work;
      ASSERT_LE(gained, 1e-6) << run << ' ' << k;  // truncation, at most 30 rad/s
      most = std::max(most, gained);
      for (const Event& event : events) {
        touched += event.kind == Kind::kTouchDown;
        lifted += event.kind == Kind::kLiftOff;
      }
      Geometry geometry;
      calc_geometry(system, after, Members::all(count), geometry);
      for (std::size_t i = 0; i < count; ++i) ASSERT_LE(geometry.stretch[i], 1e-11) << run;
    }
  }
  EXPECT_GT(touched, 100u);
  EXPECT_GT(lifted, 100u);
  note("largest_gain_j", most);
  note("touch_downs", static_cast<double>(touched));
}

TEST(CablesGroundTest, VehiclesThatLandTogetherMeetTheGroundInOneImpact) {
  // Two vehicles land beside the load that hangs between their cables: mirror images.
  System system = make_ground(2);
  Motion start = make_motion();
  start.vehicles[0].p_W = {0.6, 0.0, -0.3};
  start.vehicles[1].p_W = {-0.6, 0.0, -0.3};
  Flight flight(system, start);
  flight.fly(make_actions({0.0, 0.0, 0.0}), 1.0);
  ASSERT_EQ(flight.happened.size(), 2u);
  EXPECT_EQ(flight.happened[0].time, flight.happened[1].time);
  EXPECT_NEAR(flight.happened[0].time, std::sqrt(0.6 / 9.8), 1e-9);
  EXPECT_EQ(flight.motion.standing().size(), 3u);
}

TEST(CablesGroundTest, ALoadThatIsThrownUpTakesSixStandingVehiclesAlong) {
  // They stand 0.8 m around it; 0.6 m above them all six cables are at their length, three more
  // than the load has freedoms while the vehicles are held. Free, each gets P along n with P = m c
  // v⁺, c = 0.6, and m_L v⁺ = m_L v − 6 P c.
  System system = make_ground(6);
  Motion start = make_ring(system, 0.5 * kPi);
  for (std::size_t i = 0; i < 6; ++i)
    start.vehicles[i].p_W = {0.8 * start.vehicles[i].p_W.x(), 0.8 * start.vehicles[i].p_W.y(), 0.0};
  start.v_WL = {0.0, 0.0, -4.0};
  Flight flight(system, start);
  flight.fly(make_actions({0.0, 0.0, 0.0}), 0.2);
  const double speed = std::sqrt(16.0 - 2.0 * 9.8 * 0.6), rise = (4.0 - speed) / 9.8;
  const double impulse = 1.5 * 0.6 * 0.5 * speed / (0.5 + 6.0 * 1.5 * 0.36);
  ASSERT_EQ(flight.happened.size(), 12u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(flight.happened[i].kind, Kind::kTaut);
    EXPECT_NEAR(flight.happened[i].time, rise, 1e-9);
    EXPECT_NEAR(flight.happened[i].impulse, impulse, 1e-8);
    EXPECT_EQ(flight.happened[6 + i].kind, Kind::kLiftOff);
  }
  flight.fly(make_actions({0.0, 0.0, 0.0}), 0.8);
  EXPECT_EQ(flight.motion.standing().size(), 7u);
  EXPECT_LE(flight.motion.motion().p_WL.norm(), 1e-12);
}

TEST(CablesGroundTest, RefusesAWinchBetweenBodiesThatTheGroundHolds) {
  Motion start = make_motion();
  start.vehicles[0].p_W = {0.9, 0.0, 0.0};
  Flight flight(make_ground(), start);
  Actions actions = make_actions({0.0, 0.0, 0.0});
  actions.length_acceleration[0] = -0.5;
  EXPECT_EQ(sls::test::find_error<std::runtime_error>([&] { flight.fly(actions, 1.0); }),
            "cable 0: its winch pulls at a vehicle and a load that both stand on the ground, which "
            "holds them");
  // 0.1 m take √(0.4) s.
  EXPECT_EQ(flight.flown, 632);
}

}  // namespace
}  // namespace sls::sim::cables
