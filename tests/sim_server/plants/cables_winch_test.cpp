// Cables whose length a winch changes, and cables that are cut, against closed forms.
#include "sim_server/plants/cables/winch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim_server/plants/cables_flights.hpp"

namespace sls::sim::cables {
namespace {

TEST(CablesWinchTest, AStageIsATrapezoidOrATriangleWithinItsLimits) {
  // 2 m at 0.5 m/s and 0.25 m/s²: ramps of 2 s and 0.5 m, 2 s between. And 0.5 m: a triangle with
  // √(0.5 · 0.25) m/s at its top.
  for (const double sign : {1.0, -1.0}) {
    const double start = 3.0, top = std::sqrt(0.125);
    const std::vector<WinchPhase> longer =
        make_phases({2'000'000'000, start + sign * 2.0, 0.5, 0.25}, start);
    ASSERT_EQ(longer.size(), 4u);
    const double times[] = {2.0, 4.0, 6.0, 8.0}, ways[] = {0.0, 0.5, 1.5, 2.0},
                 rates[] = {0.0, 0.5, 0.5, 0.0}, accelerations[] = {0.25, 0.0, -0.25, 0.0};
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(longer[k].start, times[k], 1e-14);
      EXPECT_NEAR(longer[k].length, start + sign * ways[k], 1e-14);
      EXPECT_NEAR(longer[k].rate, sign * rates[k], 1e-14);
      EXPECT_NEAR(longer[k].acceleration, sign * accelerations[k], 1e-14);
    }
    const std::vector<WinchPhase> shorter =
        make_phases({2'000'000'000, start + sign * 0.5, 0.5, 0.25}, start);
    ASSERT_EQ(shorter.size(), 3u);
    EXPECT_NEAR(shorter[1].start, 2.0 + top / 0.25, 1e-14);
    EXPECT_NEAR(shorter[1].rate, sign * top, 1e-14);
    EXPECT_NEAR(shorter[2].start, 2.0 + 2.0 * top / 0.25, 1e-14);
    for (const auto& phases : {longer, shorter}) {
      EXPECT_EQ(phases.back().rate, 0.0);
      EXPECT_EQ(phases.back().acceleration, 0.0);
      for (std::size_t k = 1; k < phases.size(); ++k) {  // neither length nor rate jumps
        const WinchLength before = calc_length(phases[k - 1], phases[k].start);
        EXPECT_NEAR(before.length, phases[k].length, 1e-14);
        EXPECT_NEAR(before.rate, phases[k].rate, 1e-14);
      }
    }
    EXPECT_EQ(longer.back().length, start + sign * 2.0);
    // The way of a triangle that just reaches the rate limit.
    EXPECT_NEAR(make_phases({0, start + sign, 0.5, 0.25}, start)[1].rate, sign * 0.5, 1e-15);
  }
  const std::vector<WinchPhase> none = make_phases({2'000'000'000, 1.5, 0.5, 0.25}, 1.5);
  ASSERT_EQ(none.size(), 1u);
  EXPECT_EQ(none[0].length, 1.5);
}

TEST(CablesWinchTest, ReelingInASwingKeepsItsAngularMomentum) {
  // Without forces vehicle and load move about their centre of mass, which falls: the cable's force
  // is central, so l² θ̇ stays. At a constant rate l = 1 − v t the angle is θ̇₀ (1/l − 1) / v.
  const double speed = 1.2, rate = 0.4;
  Motion start = make_motion();
  start.vehicles[0].p_W = {0.0, 0.0, -1.0};
  start.v_WL = {speed, 0.0, rate * -1.0};
  start.vehicles[0].length_rate = -rate;
  Flight flight(make_system(), start);
  double largest = 0.0;
  for (int k = 1; k <= 1500; ++k) {
    flight.fly(make_actions({0.0, 0.0, 0.0}), 0.001);
    const double length = 1.0 - rate * 0.001 * k, angle = speed / rate * (1.0 / length - 1.0);
    const Vector3d wanted = length * Vector3d(std::sin(angle), 0.0, std::cos(angle));
    // Truncation of order 4: θ̇ grows to 7.5 rad/s.
    largest = std::max(largest, (flight.to_load() - wanted).norm());
    ASSERT_LE(largest, 1e-10) << k;
    ASSERT_NEAR(flight.motion.motion().vehicles[0].length, length, 1e-13);
    const double reduced = 1.5 * 0.5 / 2.0, turn = speed / (length * length);
    ASSERT_NEAR(flight.motion.tension()[0], reduced * turn * turn * length, 1e-8);
  }
  EXPECT_TRUE(flight.happened.empty());
  note("largest_error_m", largest);
}

/// Three vehicles that pull a plate about while their winches work.
struct Work {
  System system = make_plate(3);
  Motion start = make_ring(system, 0.5);
  Actions actions = make_actions({0.0, 0.0, 0.0});

  Work() {
    const double rates[] = {0.3, -0.5, -0.4};
    start.w_WL_L = {0.1, -0.2, 0.5};
    for (std::size_t i = 0; i < 3; ++i) {
      Vehicle& vehicle = start.vehicles[i];
      vehicle.length_rate = rates[i];
      const Vector3d n = (system.attachment_L[i] - vehicle.p_W).normalized();
      vehicle.v_W = start.w_WL_L.cross(vehicle.p_W);
      vehicle.v_W +=
          n * (n.dot(start.w_WL_L.cross(system.attachment_L[i]) - vehicle.v_W) - rates[i]);
      actions.f_Q_W[i] = vehicle.p_W * 2.0 + Vector3d(0.2, 0.1, -18.0);
      actions.length_acceleration[i] = 0.1 - 0.2 * static_cast<double>(i);
    }
  }
};

TEST(CablesWinchTest, TheEnergyGainedIsTheWorkOfForcesAndWinches) {
  // dE/dt = Σ f · v − Σ λ l̇. Constant forces work by their ways; the winches' work by Simpson's
  // rule over two steps, whose error is of order 4.
  Work work;
  Flight flight(work.system, work.start);
  const auto power = [&] {
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i)
      sum -= flight.motion.tension()[i] * flight.motion.motion().vehicles[i].length_rate;
    return sum;
  };
  flight.fly(work.actions, 0.001);
  const Motion first = flight.motion.motion();
  double winches = 0.0;
  for (int k = 0; k < 400; ++k) {
    winches += 0.001 / 3.0 * power();
    flight.fly(work.actions, 0.001);
    winches += 0.004 / 3.0 * power();
    flight.fly(work.actions, 0.001);
    winches += 0.001 / 3.0 * power();
  }
  ASSERT_TRUE(flight.happened.empty());
  const Motion last = flight.motion.motion();
  double forces = 0.0;
  for (std::size_t i = 0; i < 3; ++i)
    forces += work.actions.f_Q_W[i].dot(last.vehicles[i].p_W - first.vehicles[i].p_W);
  const double gained = calc_energy(work.system, last) - calc_energy(work.system, first);
  EXPECT_GT(std::abs(winches), 0.5);
  EXPECT_NEAR(gained, forces + winches, 1e-9);
  note("work_of_winches_j", winches);
  note("error_j", gained - forces - winches);
}

TEST(CablesWinchTest, ConvergesWithTheFourthOrder) {
  const auto fly = [](double h) {
    Work work;
    Flight flight(work.system, work.start);
    flight.fly(work.actions, 0.64, h);
    EXPECT_TRUE(flight.happened.empty());
    return flight.motion.motion();
  };
  const Motion fine = fly(0.00125);
  const auto error = [&](double h) {
    const Motion coarse = fly(h);
    return (coarse.p_WL - fine.p_WL).norm() + (coarse.q_WL - fine.q_WL).norm() +
           (coarse.vehicles[0].p_W - fine.vehicles[0].p_W).norm();
  };
  const double at_20 = error(0.02), at_10 = error(0.01);
  EXPECT_NEAR(std::log2(at_20 / at_10), 4.0, 0.3) << at_20;
  note("order", std::log2(at_20 / at_10));
}

TEST(CablesWinchTest, ASlackCableThatIsReeledInBecomesTautAtTheClosedFormsTime) {
  // Vehicle and load fall side by side, 0.8 m apart; 1 m of cable reach 0.8 m after √(2 · 0.2 / a),
  // and pull the ends together by the rate of the winch then.
  const double a = 0.7, arrival = std::sqrt(0.4 / a);
  Motion start = make_motion();
  start.vehicles[0].p_W = {0.0, 0.0, -0.8};
  Flight flight(make_system(), start);
  Actions actions = make_actions({0.0, 0.0, 0.0});
  actions.length_acceleration[0] = -a;
  flight.fly(actions, 0.8);
  expect(flight.happened, {{arrival, Event::Kind::kTaut}}, 1e-9);
  note("error_s", flight.happened[0].time - arrival);
  EXPECT_NEAR(flight.happened[0].impulse, 1.5 * 0.5 / 2.0 * a * arrival, 1e-9);
  EXPECT_NEAR(flight.to_load().norm(), 1.0 - 0.5 * a * 0.64, 1e-12);
}

TEST(CablesWinchTest, ACutLeavesMomentumAndTheBodiesInFreeFall) {
  Motion start = make_motion();
  start.vehicles[0].p_W = {0.0, 0.0, -1.0};
  start.v_WL = {1.5, 0.0, 0.0};
  Flight flight(make_system(), start);
  const Vector3d force(0.3, 0.0, -1.5 * 12.0);
  flight.fly(make_actions(force), 0.3);
  const Motion before = flight.motion.motion();
  EXPECT_GT(flight.motion.tension()[0], 1.0);
  flight.motion.cut(0);
  EXPECT_EQ(flight.motion.motion().v_WL, before.v_WL);
  EXPECT_EQ(flight.motion.motion().vehicles[0].v_W, before.vehicles[0].v_W);
  flight.fly(make_actions(force), 1.0);  // beyond the cable's length
  EXPECT_TRUE(flight.happened.empty());
  EXPECT_EQ(flight.motion.tension()[0], 0.0);
  EXPECT_TRUE(flight.motion.taut().empty());
  const Vector3d fallen(0.0, 0.0, 4.9);
  const Motion& end = flight.motion.motion();
  EXPECT_LE((end.p_WL - before.p_WL - before.v_WL - fallen).norm(), 1e-12);
  EXPECT_LE((end.vehicles[0].p_W - before.vehicles[0].p_W - before.vehicles[0].v_W - fallen -
             0.5 * force / 1.5)
                .norm(),
            1e-12);
  EXPECT_GT(flight.to_load().norm(), 2.0);
}

}  // namespace
}  // namespace sls::sim::cables
