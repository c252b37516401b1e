/// Cables that stretch.
#include <algorithm>
#include <cmath>
#include <random>

#include "tests/sim_server/plants/cables_flights.hpp"
#include "tests/sim_server/plants/cables_oracle.hpp"

namespace sls::sim::cables {
namespace {

/// A vehicle of 1.5 kg that holds a load of 0.5 kg; the cable is along z, `slack` metres short of
/// its length. The stretch φ follows φ̈ = a − (k φ + c φ̇) / μ, with a = (m + m_L) g / m.
constexpr double kFree = 2.0 * 9.8 / 1.5, kReduced = 1.5 * 0.5 / 2.0;

Flight make_drop(double stiffness, double damping, double slack) {
  System system = make_system();
  system.stiffness[0] = stiffness;
  system.damping[0] = damping;
  Motion start = make_motion();
  start.vehicles[0].p_W = {0.0, 0.0, -(1.0 - slack)};
  return Flight(system, start);
}

const Actions kHolding = make_actions({0.0, 0.0, -2.0 * 9.8});

/// Stretch and its rate at `time` after the cable reached its length with `rate`.
struct Oscillation {
  double stiffness, damping, rate;

  std::pair<double, double> at(double time) const {
    const double decay = 0.5 * damping / kReduced;
    const double w = std::sqrt(stiffness / kReduced - decay * decay);
    const double steady = kFree * kReduced / stiffness;
    const double a = -steady, b = (rate + decay * a) / w;
    const double e = std::exp(-decay * time), c = std::cos(w * time), s = std::sin(w * time);
    return {steady + e * (a * c + b * s), e * ((b * w - decay * a) * c - (a * w + decay * b) * s)};
  }
  double calc_tension(double time) const {
    const auto [stretch, its_rate] = at(time);
    return stiffness * stretch + damping * its_rate;
  }
};

TEST(CablesSpringTest, ADropMeetsABoundedTensionAndReboundsAsTheOscillatorDoes) {
  for (const double damping : {0.0, 2.0}) {
    SCOPED_TRACE(damping);
    const double stiffness = 300.0, slack = 0.2;
    const double taut = std::sqrt(2.0 * slack / kFree);
    const Oscillation closed{stiffness, damping, kFree * taut};
    double low = 0.05, high = 0.2;  // of the time at which the tension is 0 again
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (closed.calc_tension(middle) > 0.0 ? low : high) = middle;
    }
    Flight flight = make_drop(stiffness, damping, slack);
    double largest = 0.0;
    for (int k = 1; k <= 400; ++k) {
      flight.fly(kHolding, 0.001);
      const double since = 0.001 * k - taut;
      if (since > 0.0 && since < low)
        largest =
            std::max(largest, std::abs(flight.motion.tension()[0] - closed.calc_tension(since)));
    }
    EXPECT_LE(largest, 1e-6);  // of 60 N
    ASSERT_GE(flight.happened.size(), 2u);
    expect({flight.happened[0], flight.happened[1]},
           {{taut, Event::Kind::kTaut}, {taut + low, Event::Kind::kSlack}}, 1e-8);
    EXPECT_LE(flight.motion.energy_error(), HybridMotion::kCoarse);
  }
}

TEST(CablesSpringTest, ConvergesWithTheFourthOrderAcrossItsEvents) {
  const auto fly = [](double h) {
    Flight flight = make_drop(300.0, 2.0, 0.2);
    flight.fly(kHolding, 0.6, h);
    EXPECT_GE(flight.happened.size(), 3u);
    return flight.to_load().z();
  };
  const double fine = fly(0.00025);
  const double ratio = std::abs(fly(0.0025) - fine) / std::abs(fly(0.00125) - fine);
  EXPECT_NEAR(std::log2(ratio), 4.0, 0.5);  // where events fall in a step changes a factor
}

TEST(CablesSpringTest, TendsToTheCableThatDoesNotStretchWithTheFirstOrderOfItsStiffness) {
  // Three vehicles swing a plate; each cable begins at the stretch that its share needs.
  const auto fly = [](double stiffness) {
    System system = make_plate(3);
    Motion start = make_ring(system, 0.5);
    for (std::size_t i = 0; i < 3; ++i) {
      if (stiffness == 0.0) break;
      system.stiffness[i] = stiffness;
      system.damping[i] = 0.02 * stiffness;
      const double share = 0.5 * 9.8 / 3.0 / std::cos(0.5);
      start.vehicles[i].p_W +=
          share / stiffness * (start.vehicles[i].p_W - system.attachment_L[i]).normalized();
    }
    Flight flight(system, start);
    Actions actions = make_actions({0.0, 0.0, 0.0});
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3d up = (start.vehicles[i].p_W - system.attachment_L[i]).normalized();
      actions.f_Q_W[i] = 0.5 * 9.8 / 3.0 / std::cos(0.5) * up + Vector3d(0.2, 0.1, -1.5 * 9.8);
    }
    flight.fly(actions, 1.0, 0.0002);
    EXPECT_TRUE(flight.happened.empty());
    return flight.motion.motion().p_WL;
  };
  const Vector3d limit = fly(0.0);
  const double soft = (fly(1e3) - limit).norm(), firm = (fly(1e4) - limit).norm();
  EXPECT_LE(soft, 0.01);
  EXPECT_NEAR(soft / firm, 10.0, 1.0);
}

TEST(CablesSpringTest, RandomGroupsOfBothKindsKeepEnergyMomentumAndTheirStiffCables) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  std::size_t happened = 0;
  for (int run = 0; run < 24; ++run) {
    const auto count = 2 + static_cast<std::size_t>(run % 4);
    oracle::Scene scene = oracle::make_scene(random, count, run % 2 == 0, true);
    System& system = scene.system;
    Members stiff;
    for (std::size_t i = 0; i < count; ++i) {
      scene.motion.vehicles[i].length_rate = 0.0;
      if (i % 2 == 0)
        system.stiffness[i] = 200.0 + 100.0 * any(random);  // without damping
      else
        stiff.add(i);
    }
    HybridMotion motion(system, scene.motion);
    Actions actions;
    double mass = system.load_mass;
    Vector3d force = Vector3d::Zero();
    for (std::size_t i = 0; i < count; ++i) {
      mass += system.vehicle_mass[i];
      actions.f_Q_W[i] = Vector3d(any(random), any(random), -9.8 + any(random));
      force += actions.f_Q_W[i];
    }
    const auto momentum = [&] {
      Vector3d sum = system.load_mass * motion.motion().v_WL;
      for (std::size_t i = 0; i < count; ++i)
        sum += system.vehicle_mass[i] * motion.motion().vehicles[i].v_W;
      return sum;
    };
    const auto energy = [&] {  // with that of the springs, less the work of the held forces
      double sum = calc_energy(system, motion.motion());
      Geometry geometry;
      calc_geometry(system, motion.motion(), Members::all(count), geometry);
      for (std::size_t i = 0; i < count; ++i) {
        const double stretch = std::max(0.0, geometry.stretch[i]);
        sum += 0.5 * system.stiffness[i] * stretch * stretch -
               actions.f_Q_W[i].dot(motion.motion().vehicles[i].p_W);
      }
      return sum;
    };
    const Vector3d start = momentum();
    double last = energy();
    std::vector<Event> events;
    for (int k = 1; k <= 1000; ++k) {
      events.clear();
      motion.step(actions, 0.0005, events);
      happened += events.size();
      const double now = energy();
      ASSERT_LE(now - last, 1e-7) << run << " " << k;  // impacts of stiff cables only take it
      if (events.empty()) ASSERT_NEAR(now, last, 1e-7) << run << " " << k;
      last = now;
      Geometry geometry;
      calc_geometry(system, motion.motion(), stiff, geometry);
      for (const std::size_t i : stiff) ASSERT_LE(geometry.stretch[i], 1e-11) << run;
      for (std::size_t i = 0; i < count; ++i) ASSERT_GE(motion.tension()[i], -1e-9);
    }
    const Vector3d expected = start + 0.5 * (force + Vector3d(0.0, 0.0, mass * 9.8));
    EXPECT_LE((momentum() - expected).norm(), 1e-10) << run;
  }
  EXPECT_GT(happened, 100u);
}

}  // namespace
}  // namespace sls::sim::cables
