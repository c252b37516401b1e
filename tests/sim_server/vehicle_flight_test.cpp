// What flies a vehicle in real time where its answers come late, and what counts as absence.
#include "sim_server/vehicle_flight.hpp"

#include <gtest/gtest.h>

#include "common/config/scenario.hpp"

namespace sls::sim {
namespace {

using Action = ControllerAbsence::Action;

constexpr std::uint64_t kRun = 7;
constexpr std::uint64_t kHeldSteps = 125;  // max_hold_s 0.5 at 4 ms

class VehicleFlightTest : public testing::Test {
 protected:
  static config::Scenario load_realtime() {
    auto scenario = config::load_scenario(SLS_SOURCE_DIR "/config/scenarios/short.yaml");
    scenario.sync.mode = config::SyncMode::kRealtime;
    return scenario;
  }

  static ControlCommand make_answer(std::uint64_t step) {
    ControlCommand answer;
    answer.run_id(kRun);
    answer.step(step);
    answer.f_Q_W_n({0.0, 0.0, -16.0 - 0.001 * static_cast<double>(step)});
    answer.client_name("late");
    answer.mission(MISSION_RUNNING);
    return answer;
  }

  /// Flies `step` without an answer to it, the answers to `late` having come during it.
  void fly(std::uint64_t step, const std::vector<std::uint64_t>& late) {
    flight_.measure(step, {});
    for (const std::uint64_t answered : late) flight_.keep_late_answer(make_answer(answered));
    flight_.fly_without_answer(flight_.absence.decide(0.0, 0.0));
  }
  const Applied& applied() const { return flight_.outcome()->applied; }

  VehicleFlight flight_{load_realtime(), 0, kRun};
};

TEST_F(VehicleFlightTest, AnswersThatAreAllOnePeriodLateFlyItWithoutEnd) {
  fly(0, {});
  for (std::uint64_t step = 1; step < 4 * kHeldSteps; ++step) {
    fly(step, {step - 1});
    ASSERT_EQ(applied().origin, FORCE_HELD) << step;
    ASSERT_EQ(applied().answer_f_Q_W.z(), make_answer(step - 1).f_Q_W_n()[2]) << step;
    ASSERT_EQ(flight_.calc_age(), 1u) << step;
  }
}

TEST_F(VehicleFlightTest, OnlyANewerAnswerIsFresh) {
  fly(0, {});
  fly(1, {0});
  fly(2, {1});
  for (std::uint64_t step = 3; step < 2 + kHeldSteps; ++step) {
    fly(step, {0, 1});  // what it has already
    ASSERT_EQ(applied().origin, FORCE_HELD) << step;
  }
  fly(2 + kHeldSteps, {0, 1});
  EXPECT_EQ(applied().origin, FORCE_FAIL_SAFE);
  fly(3 + kHeldSteps, {2});
  EXPECT_EQ(applied().origin, FORCE_HELD) << "a newer one, however late, ends the fail-safe";
}

TEST_F(VehicleFlightTest, ALateAnswerEndsTheAbsence) {
  flight_.measure(0, {});
  flight_.note_waiting(VehicleFlight::Clock::now() - std::chrono::hours(1));
  EXPECT_GE(flight_.calc_absence_s(), 3600.0);
  flight_.keep_late_answer(make_answer(0));
  EXPECT_EQ(flight_.calc_absence_s(), 0.0);
}

TEST_F(VehicleFlightTest, APauseIsNoAbsence) {
  flight_.note_rest(std::chrono::hours(1));
  EXPECT_EQ(flight_.calc_absence_s(), 0.0);
  flight_.measure(0, {});
  flight_.note_waiting(VehicleFlight::Clock::now() - std::chrono::hours(2));
  flight_.note_rest(std::chrono::hours(1));
  EXPECT_GE(flight_.calc_absence_s(), 3600.0);
  EXPECT_LT(flight_.calc_absence_s(), 7200.0);
}

}  // namespace
}  // namespace sls::sim
