// Flights with cables against closed forms. One cable between a vehicle under a constant force F
// straight up and a load: gravity moves both alike, so the load swings about the vehicle under the
// gravity F / m, and its tension is that of the reduced mass μ = m m_L / (m + m_L).
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "sim_server/plants/analytic/analytic_plant.hpp"
#include "tests/sim_server/plants/cables_flights.hpp"
#include "tests/sim_server/plants/cables_oracle.hpp"
#include "tests/sim_server/plants/plant_flights.hpp"

namespace sls::sim::cables {
namespace {

TEST(CablesMotionTest, SlackCablesLeaveAllBodiesInFreeFall) {
  System system = make_system(2);
  Motion start = make_motion();
  start.v_WL = {0.3, 0.0, -0.1};
  start.vehicles[0].p_W = {0.0, 0.2, -0.3};
  start.vehicles[1].p_W = {0.0, -0.4, -0.1};
  start.vehicles[1].v_W = {0.1, -0.2, 0.0};
  Flight flight(system, start);
  Actions actions = make_actions({0.0, 0.0, 0.0});
  actions.f_Q_W[0] = {0.15, 0.0, -0.3};
  flight.fly(actions, 1.0);
  const Motion& end = flight.motion.motion();
  EXPECT_TRUE(flight.happened.empty());
  const Vector3d fallen(0.0, 0.0, 4.9);
  EXPECT_LE((end.p_WL - fallen - start.v_WL).norm(), 1e-13);  // 1000 roundings of numbers below 5
  EXPECT_LE(
      (end.vehicles[0].p_W - start.vehicles[0].p_W - fallen - Vector3d(0.05, 0.0, -0.1)).norm(),
      1e-13);
  EXPECT_LE((end.vehicles[1].p_W - start.vehicles[1].p_W - fallen - start.vehicles[1].v_W).norm(),
            1e-13);
}

TEST(CablesMotionTest, ADroppedLoadStopsItsFallInAnInelasticImpact) {
  // The vehicle hovers, the load falls 0.6 m; then both have the velocity of their centre of mass.
  for (const double restitution : {0.0, 0.5}) {
    System system = make_system();
    system.restitution = restitution;
    Motion start = make_motion();
    start.vehicles[0].p_W = {0.0, 0.0, -0.4};
    Flight flight(system, start);
    const double arrival = std::sqrt(2.0 * 0.6 / 9.8), speed = 9.8 * arrival;
    flight.fly(make_actions({0.0, 0.0, -1.5 * 9.8}), 0.349);
    expect(flight.happened, {}, 0.0);
    flight.fly(make_actions({0.0, 0.0, -1.5 * 9.8}), 0.001);
    EXPECT_NEAR(flight.happened.at(0).impulse, speed * (1.0 + restitution) * 1.5 * 0.5 / 2.0, 1e-8);
    const double after = flight.flown * 0.001 - arrival;
    const Motion& end = flight.motion.motion();
    const double common = speed * 0.5 / 2.0, apart = restitution * speed;
    if (restitution == 0.0) {
      expect(flight.happened, {{arrival, Event::Kind::kTaut}}, 1e-9);
      const double gravity = 9.8 * 0.5 / 2.0;  // of both
      EXPECT_NEAR(end.v_WL.z(), common + gravity * after, 1e-12);
      EXPECT_NEAR(end.vehicles[0].v_W.z(), common + gravity * after, 1e-12);
    } else {
      expect(flight.happened, {{arrival, Event::Kind::kTaut}, {arrival, Event::Kind::kSlack}},
             1e-9);
      EXPECT_NEAR(end.v_WL.z(), common - apart * 1.5 / 2.0 + 9.8 * after, 1e-12);
      EXPECT_NEAR(end.vehicles[0].v_W.z(), common + apart * 0.5 / 2.0, 1e-12);
    }
  }
}

/// The load below its vehicle at `speed` relative to it, under a force of m `gravity` upwards.
Flight make_swing(double speed) {
  Motion start = make_motion();
  start.vehicles[0].p_W = {0.0, 0.0, -1.0};
  start.v_WL = {speed, 0.0, 0.0};
  return Flight(make_system(), start);
}

/// With v₀² between 4 and 5 g l the load passes the height of the vehicle, and the cable goes
/// slack.
struct Swing {
  explicit Swing(double g) : gravity(g), speed(std::sqrt(4.5 * g)) {
    // v²/l + g cos θ = 0 with v² = v₀² − 2 g l (1 − cos θ); θ̇ = v₀/l √(1 − k² sin²(θ/2)).
    const double cosine = (2.0 * gravity - speed * speed) / (3.0 * gravity);
    const double angle = std::acos(cosine);
    slack = 2.0 / speed * std::ellint_1(std::sqrt(4.0 * gravity) / speed, 0.5 * angle);
    const double v = std::sqrt(-gravity * cosine);
    // |r + v t + ½ g t²| = l has the solutions 0 (three times) and −4 v·g / g².
    flight = 4.0 * v * std::sin(angle) / gravity;  // v·g = −v g sin θ
  }
  double gravity, speed, slack = 0.0, flight = 0.0;
};

TEST(CablesMotionTest, ASwingGoesSlackAndTautAgainAtTheClosedFormsTimes) {
  const Swing swing(12.0);
  for (const double h : {0.001, 0.0005}) {
    Flight flight = make_swing(swing.speed);
    flight.fly(make_actions({0.0, 0.0, -1.5 * 12.0}), swing.slack + swing.flight + 0.01, h);
    ASSERT_EQ(flight.happened.size(), 2u);
    expect(flight.happened,
           {{swing.slack, Event::Kind::kSlack}, {swing.slack + swing.flight, Event::Kind::kTaut}},
           1e-9);
  }
}

TEST(CablesMotionTest, TheTensionOfASwingIsThatOfTheReducedMass) {
  Flight flight = make_swing(2.0);
  const double reduced = 1.5 * 0.5 / 2.0;
  for (int k = 0; k < 500; ++k) {
    flight.fly(make_actions({0.0, 0.0, -1.5 * 12.0}), 0.001);
    const double cosine = flight.to_load().z(), v2 = 4.0 - 2.0 * 12.0 * (1.0 - cosine);
    ASSERT_NEAR(flight.motion.tension()[0], reduced * (v2 + 12.0 * cosine), 1e-9);
  }
}

TEST(CablesMotionTest, SeesATensionThatIsNegativeOnlyInsideAStep) {
  // A speed so that the tension is negative for some 10 ms at the top of a loop: v₀² just below 5 g
  // l.
  const double gravity = 12.0, speed = std::sqrt(4.9999 * gravity);
  const double angle = std::acos((2.0 * gravity - speed * speed) / (3.0 * gravity));
  const double slack = 2.0 / speed * std::ellint_1(std::sqrt(4.0 * gravity) / speed, 0.5 * angle);
  const double top = 2.0 / speed * std::ellint_1(std::sqrt(4.0 * gravity) / speed, 0.5 * kPi);
  ASSERT_LT(2.0 * (top - slack), 0.01);
  Flight flight = make_swing(speed);
  flight.fly(make_actions({0.0, 0.0, -1.5 * gravity}), std::floor(slack / 0.001 - 2.0) * 0.001);
  const double from = flight.flown * 0.001;
  ASSERT_LT(from, slack);
  ASSERT_GT(from + 0.02, top + (top - slack));  // positive again, had the cable been held
  std::vector<Event> events;
  flight.motion.step(make_actions({0.0, 0.0, -1.5 * gravity}), 0.02, events);
  ASSERT_GE(events.size(), 1u);
  EXPECT_EQ(events[0].kind, Event::Kind::kSlack);
  EXPECT_NEAR(from + events[0].time, slack, 1e-6);  // a step of 20 ms has errors of 1e-7 s
}

TEST(CablesMotionTest, SeesADistanceThatExceedsTheLengthOnlyInsideAStep) {
  // The load is thrown up from the vehicle and would be beyond 1 m for a quarter of the step.
  const double h = 0.02, rise = 9.8 * 0.125 * h * h / 16.0;
  Motion start = make_motion();
  start.vehicles[0].p_W = {0.0, 0.0, 1.0 - 9.8 * h * h / 8.0 + rise};  // below the load
  start.v_WL = {0.0, 0.0, -9.8 * h / 2.0};
  Flight flight(make_system(), start);
  std::vector<Event> events;
  flight.motion.step(make_actions({0.0, 0.0, -1.5 * 9.8}), h, events);
  // The top is at h/2, its distance 1 m + rise.
  const double arrival = h / 2.0 - std::sqrt(2.0 * rise / 9.8);
  EXPECT_GT(arrival, 0.3 * h);
  // The impact stops the load, which falls back at once.
  expect(events, {{arrival, Event::Kind::kTaut}, {arrival, Event::Kind::kSlack}}, 1e-9);
  const Motion& end = flight.motion.motion();
  EXPECT_LE((end.p_WL - end.vehicles[0].p_W).norm(), 1.0 + 1e-12);
}

/// Forces that hold a ring of vehicles still: each carries itself and its share, and pulls
/// outwards.
Actions make_holding(const System& system, double angle) {
  Actions actions;
  const double share = system.load_mass * system.gravity / static_cast<double>(system.count);
  for (std::size_t i = 0; i < system.count; ++i) {
    const double at = 2.0 * kPi * static_cast<double>(i) / static_cast<double>(system.count);
    const double out = share * std::tan(angle);
    actions.f_Q_W[i] = {out * std::cos(at), out * std::sin(at),
                        -share - system.vehicle_mass[i] * system.gravity};
  }
  return actions;
}

TEST(CablesMotionTest, FormationsStandStillWithTheTensionsOfStatics) {
  for (const bool is_plate : {false, true})
    for (const std::size_t count : {2, 3, 4, 6, 16}) {
      const System system = is_plate ? make_plate(count) : make_system(count);
      const Motion start = make_ring(system, 0.4);
      Flight flight(system, start);
      flight.fly(make_holding(system, 0.4), 1.0);
      EXPECT_TRUE(flight.happened.empty()) << count;
      const double tension =
          system.load_mass * system.gravity / static_cast<double>(count) / std::cos(0.4);
      for (std::size_t i = 0; i < count; ++i)
        EXPECT_NEAR(flight.motion.tension()[i], tension, 1e-11) << count;
      // A formation is no stable equilibrium: errors of rounding grow by e^(t √(g/l)) = 20.
      EXPECT_LE(flight.motion.motion().p_WL.norm(), 1e-13) << count;
    }
}

TEST(CablesMotionTest, CablesThatArriveTogetherMeetInOneImpact) {
  // The load falls onto a ring of cables at the angle θ. By symmetry each has the same impulse P:
  // m_L v⁺ = m_L v − N P cos θ, and its vehicle gets P / m = v⁺ cos θ along it.
  for (const bool is_plate : {false, true})
    for (const std::size_t count : {2, 3, 6}) {
      const System system = is_plate ? make_plate(count) : make_system(count);
      Motion start = make_ring(system, 0.4);
      start.p_WL.z() = -0.3;
      Flight flight(system, start);
      Actions hovering = make_actions({0.0, 0.0, -1.5 * 9.8});
      const double arrival = std::sqrt(2.0 * 0.3 / 9.8), speed = 9.8 * arrival;
      flight.fly(hovering, 0.247);
      EXPECT_TRUE(flight.happened.empty());
      std::vector<Event> events;
      flight.motion.step(hovering, 0.001, events);
      ASSERT_EQ(events.size(), count);
      const double vehicles = 1.5 * static_cast<double>(count) * std::cos(0.4) * std::cos(0.4);
      const double after = speed * 0.5 / (0.5 + vehicles);
      for (const Event& event : events) {
        EXPECT_EQ(event.kind, Event::Kind::kTaut);
        EXPECT_NEAR(0.247 + event.time, arrival, 1e-9);
        EXPECT_EQ(event.time, events[0].time);
        EXPECT_NEAR(event.impulse, 1.5 * after * std::cos(0.4), 1e-8);  // 1e-9 s of fall
      }
      const Motion& end = flight.motion.motion();
      EXPECT_LE(std::hypot(end.p_WL.x(), end.p_WL.y()), 1e-14);
      EXPECT_LE(end.w_WL_L.norm(), 1e-13);
      for (std::size_t i = 1; i < count; ++i)
        EXPECT_NEAR(end.vehicles[i].v_W.z(), end.vehicles[0].v_W.z(), 1e-13);
      EXPECT_LT(end.v_WL.z(), speed);
    }
}

/// The centre of mass of everything, and its angular momentum about the origin.
Vector3d calc_angular_momentum(const System& system, const Motion& motion) {
  Vector3d sum = system.load_mass * motion.p_WL.cross(motion.v_WL);
  if (system.is_rigid) sum += oracle::to_rotation(motion) * (system.inertia_L * motion.w_WL_L);
  for (std::size_t i = 0; i < system.count; ++i)
    sum += system.vehicle_mass[i] * motion.vehicles[i].p_W.cross(motion.vehicles[i].v_W);
  return sum;
}

TEST(CablesMotionTest, KeepsMomentumAndNeverGainsEnergyThroughManyEvents) {
  // Bodies that tumble without gravity and forces, their cables slack and taut in turn.
  System system = make_plate(4);
  system.inertia_L *= 10.0;  // so that it turns slowly enough for steps of 1 ms
  system.inverse_inertia_L /= 10.0;
  system.gravity = 0.0;
  Motion start = make_ring(system, 0.6);
  start.w_WL_L = {2.0, 5.0, -3.0};
  for (std::size_t i = 0; i < 4; ++i) {
    start.vehicles[i].p_W *= 0.7;
    start.vehicles[i].v_W = Vector3d(1.0, -2.0, 0.5) * (i % 2 == 0 ? 1.0 : -1.0) +
                            Vector3d(0.1, 0.0, 0.2) * static_cast<double>(i);
  }
  const auto energy_of = [&](const Motion& motion) {
    double sum = 0.5 * system.load_mass * motion.v_WL.squaredNorm() +
                 0.5 * motion.w_WL_L.dot(system.inertia_L * motion.w_WL_L);
    for (std::size_t i = 0; i < 4; ++i) sum += 0.75 * motion.vehicles[i].v_W.squaredNorm();
    return sum;
  };
  const auto momentum_of = [&](const Motion& motion) {
    Vector3d sum = system.load_mass * motion.v_WL;
    for (std::size_t i = 0; i < 4; ++i) sum += 1.5 * motion.vehicles[i].v_W;
    return sum;
  };
  Flight flight(system, start);
  double energy = energy_of(start);
  for (int k = 0; k < 3000; ++k) {
    flight.fly(make_actions(Vector3d::Zero()), 0.001);
    const double now = energy_of(flight.motion.motion());
    ASSERT_LE(now - energy, 1e-9) << "step " << k;  // truncation
    energy = now;
  }
  EXPECT_GT(flight.happened.size(), 5u);
  EXPECT_LT(energy, 0.9 * energy_of(start));
  const Motion& end = flight.motion.motion();
  EXPECT_LE((momentum_of(end) - momentum_of(start)).norm(), 1e-12);  // 3000 roundings
  EXPECT_LE((calc_angular_momentum(system, end) - calc_angular_momentum(system, start)).norm(),
            1e-9);
  for (std::size_t i = 0; i < 4; ++i) {
    Geometry geometry;
    calc_geometry(system, end, Members::all(4), geometry);
    EXPECT_LE(geometry.stretch[i], 1e-12);
  }
}

TEST(CablesMotionTest, ABouncingLoadComesToRestInFiniteTimeWithItsCableTaut) {
  // Bounces shorten by 0.8 each: infinitely many until 2 v e / (g (1 − e)), all in the last steps.
  System system = make_system();
  system.restitution = 0.8;
  Motion start = make_motion();
  start.vehicles[0].p_W = {0.0, 0.0, -0.9};
  Flight flight(system, start);
  // The relative motion is a ball under the gravity F / m = 9.8 m/s² on the ground.
  const double first = std::sqrt(2.0 * 0.1 / 9.8);
  const double last = first + 2.0 * first * 0.8 / (1.0 - 0.8);
  flight.fly(make_actions({0.0, 0.0, -1.5 * 9.8}), last + 0.01);
  ASSERT_FALSE(flight.happened.empty());
  EXPECT_NEAR(flight.happened.back().time, last, 1e-3);  // in the last step
  EXPECT_EQ(flight.motion.taut().size(), 1u);
  // Together both fall with the acceleration of a hovering vehicle that carries the load, and
  // their centre of mass has never felt the impacts.
  const double time = flight.flown * 0.001;
  const Motion& end = flight.motion.motion();
  EXPECT_NEAR(flight.to_load().z(), 1.0, 1e-12);
  EXPECT_NEAR(end.v_WL.z(), 9.8 * 0.25 * time, 1e-11);
}

TEST(CablesMotionTest, ACableThatArrivesAtTheEndOfAStepRebounds) {
  // The relative motion falls with 9.8 m/s² and arrives at 0.1 s, the end of step 100, but for
  // rounding.
  System system = make_system();
  system.restitution = 0.5;
  Motion start = make_motion();
  start.vehicles[0].p_W = {0.0, 0.0, -(1.0 - 0.5 * 9.8 * 0.01)};
  Flight flight(system, start);
  flight.fly(make_actions({0.0, 0.0, -1.5 * 9.8}), 0.102);
  ASSERT_FALSE(flight.happened.empty());
  EXPECT_NEAR(flight.happened[0].time, 0.1, 1e-11);
  const Motion& end = flight.motion.motion();
  EXPECT_NEAR(end.v_WL.z() - end.vehicles[0].v_W.z(), -0.5 * 0.98 + 0.002 * 9.8, 1e-11);
}

TEST(CablesMotionTest, RandomFlightsLoseNoTimeAndNeverStretchACable) {
  // The centre of mass moves as if there were no cables: each lost part of a step would show.
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  std::size_t happened = 0;
  for (int run = 0; run < 24; ++run) {
    const auto count = 1 + static_cast<std::size_t>(run % 6);
    oracle::Scene scene = oracle::make_scene(random, count, run % 4 < 2, false);
    System& system = scene.system;
    system.restitution = run % 3 == 0 ? 0.5 : 0.0;
    for (Vehicle& vehicle : scene.motion.vehicles) vehicle.length_rate = 0.0;
    HybridMotion motion(system, scene.motion);
    double mass = system.load_mass;
    for (std::size_t i = 0; i < count; ++i) mass += system.vehicle_mass[i];
    const auto mean = [&](auto Vehicle::*member, const Vector3d& of_load) {
      Vector3d sum = system.load_mass * of_load;
      for (std::size_t i = 0; i < count; ++i)
        sum += system.vehicle_mass[i] * motion.motion().vehicles[i].*member;
      return Vector3d(sum / mass);
    };
    Vector3d p = mean(&Vehicle::p_W, motion.motion().p_WL);
    Vector3d v = mean(&Vehicle::v_W, motion.motion().v_WL);
    std::vector<Event> events;
    Actions actions;
    const double h = run % 2 == 0 ? 0.001 : 0.005;
    for (int k = 0; k < 1000; ++k) {
      Vector3d acceleration(0.0, 0.0, system.gravity);
      for (std::size_t i = 0; i < count; ++i) {
        const Vehicle& vehicle = motion.motion().vehicles[i];
        if (k % 20 == 0)
          actions.f_Q_W[i] = 5.0 * Vector3d(any(random), any(random), any(random)) -
                             0.5 * (vehicle.v_W + vehicle.p_W) -
                             Vector3d(0.0, 0.0, 9.8 * mass / static_cast<double>(count));
        acceleration += actions.f_Q_W[i] / mass;
      }
      p += h * v + 0.5 * h * h * acceleration;
      v += h * acceleration;
      events.clear();
      motion.step(actions, h, events);
      happened += events.size();
      Geometry geometry;
      calc_geometry(system, motion.motion(), Members::all(count), geometry);
      for (std::size_t i = 0; i < count; ++i) ASSERT_LE(geometry.stretch[i], 1e-11) << run;
    }
    EXPECT_LE((mean(&Vehicle::p_W, motion.motion().p_WL) - p).norm(), 1e-10) << run;
  }
  EXPECT_GT(happened, 2000u);
}

/// Forces that count how often a step or a part of it is flown.
class CountedForces : public Propulsion {
 public:
  void turn(const RotorSpeeds&, double, RotorSpeeds&, RotorSpeeds&, RotorSpeeds&) const override {
    ++count;
  }
  void push(const Motion&, const RotorSpeeds&, Actions& actions) const override {
    actions.f_Q_W = forces;
  }
  Vectors forces{};
  mutable std::size_t count = 0;
};

TEST(CablesMotionTest, AnEventOfChatteringCablesTakesFewIntegrations) {
  // One of six vehicles is shaken: the load rocks on its cables, which throw each other slack. A
  // flight without events integrates once in a step. A search of each arrival by regula falsi
  // took 38 for an event.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  const System system = make_plate(6);
  const Motion start = make_ring(system, 0.3);
  HybridMotion motion(system, start);
  CountedForces counted;
  Actions actions;
  actions.propulsion = &counted;
  const std::size_t steps = 3000;
  std::vector<Event> events;
  Vector3d shake;
  for (std::size_t k = 0; k < steps; ++k) {
    for (std::size_t i = 0; i < 6; ++i) {
      const Vehicle& vehicle = motion.motion().vehicles[i];
      counted.forces[i] = 30.0 * (start.vehicles[i].p_W - vehicle.p_W) - 10.0 * vehicle.v_W -
                          Vector3d(0.0, 0.0, 9.8 * (1.5 + 0.5 / 6.0));
    }
    if (k % 4 == 0) shake = 60.0 * Vector3d(any(random), any(random), any(random));
    counted.forces[0] += shake;
    motion.step(actions, 0.001, events);
  }
  EXPECT_GT(events.size(), steps);
  EXPECT_LE(counted.count, steps + 6 * events.size());
}

TEST(CablesMotionTest, ConvergesWithTheFourthOrderAwayFromEventsAndAcrossThem) {
  const auto fly = [](double h, bool has_events) {
    const System system = make_plate(3);
    Motion start = make_ring(system, 0.5);
    start.w_WL_L = {0.0, 0.0, 0.5};
    start.v_WL = {0.2, -0.1, 0.0};
    for (Vehicle& vehicle : start.vehicles)
      vehicle.v_W = start.v_WL + start.w_WL_L.cross(vehicle.p_W);
    if (has_events) start.v_WL.z() = -1.5;
    Flight flight(system, start);
    Actions actions = make_holding(system, 0.5);
    actions.f_Q_W[0] += Vector3d(0.1, 0.05, -0.1);
    flight.fly(actions, 0.96, h);
    EXPECT_EQ(flight.happened.empty(), !has_events);
    return flight.motion.motion();
  };
  for (const bool has_events : {false, true}) {
    const Motion fine = fly(0.00125, has_events);
    const auto error = [&](double h) {
      const Motion coarse = fly(h, has_events);
      return (coarse.p_WL - fine.p_WL).norm() + (coarse.q_WL - fine.q_WL).norm() +
             (coarse.vehicles[0].p_W - fine.vehicles[0].p_W).norm();
    };
    const double at_20 = error(0.02), at_10 = error(0.01);
    // Where an event falls within a step changes the error by a factor, not its order.
    EXPECT_NEAR(std::log2(at_20 / at_10), 4.0, has_events ? 1.0 : 0.3) << at_20;
  }
}

TEST(CablesMotionTest, ATautFlightIsThatOfTheAnalyticPlant) {
  // 32 s of shaking. Both have errors of fourth order at 1 ms in different coordinates.
  const model::SlungLoadParameters vehicle;
  config::Plant config;
  config.initial.position = {0.2, -0.1, -1.0};
  config.initial.v_WQ = {0.1, 0.2, -0.1};
  config.initial.rod = {0.3, -0.2, 0.5, 0.4};
  config.air.rotor_drag = 0.3;
  config.air.v_wind_W = {2.0, -1.0, 0.3};
  config.disturbance_W = {0.3, -0.2, 0.1};
  AnalyticPlant plant(vehicle, config);
  System system = make_system();
  system.vehicle_mass[0] = vehicle.quad_mass;
  system.load_mass = vehicle.load_mass;
  system.gravity = vehicle.gravity;
  Motion start = make_motion();
  start.p_WL = plant.measurement(0).p_WL;
  start.v_WL = plant.measurement(0).v_WL;
  start.vehicles[0].p_W = plant.measurement(0).p_WQ;
  start.vehicles[0].v_W = plant.measurement(0).v_WQ;
  Flight flight(system, start);
  Actions actions;
  actions.air = config.air;
  actions.disturbance_W = config.disturbance_W;
  double largest = 0.0;
  for (int k = 0; k < 32'000; ++k) {
    const model::Measurement& state = plant.measurement(0);
    const Vector3d force = calc_shaking_force(k * kStep, state.p_WQ, state.v_WQ,
                                              vehicle.total_mass(), vehicle.gravity);
    plant.advance({force}, 1);
    actions.f_Q_W[0] = force;
    flight.fly(actions, 0.001);
    largest = std::max({largest, (state.p_WL - flight.motion.motion().p_WL).norm(),
                        (state.p_WQ - flight.motion.motion().vehicles[0].p_W).norm()});
  }
  EXPECT_TRUE(flight.happened.empty());
  EXPECT_LE(largest, 1e-8);
  RecordProperty("largest_difference_m", std::to_string(largest * 1e12) + "e-12");
}

}  // namespace
}  // namespace sls::sim::cables
