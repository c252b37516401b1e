// The force on a vehicle in real time when answers are late, and the beginning of absence.
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

  static OfferedAnswer make_answer(std::uint64_t step) {
    OfferedAnswer answer;
    answer.run_id = kRun;
    answer.step = step;
    answer.client_name = "late";
    answer.command.f_Q_W_n({0.0, 0.0, -16.0 - 0.001 * static_cast<double>(step)});
    answer.command.reference().stage_index(7);
    answer.command.mission(MissionPhase::MISSION_RUNNING);
    return answer;
  }

  /// Flies `step` without an answer to it. The answers to the steps `late` arrive during it.
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
    ASSERT_EQ(applied().origin, ForceOrigin::FORCE_HELD) << step;
    ASSERT_EQ(applied().answer_f_Q_W.z(), make_answer(step - 1).command.f_Q_W_n()[2]) << step;
    ASSERT_EQ(flight_.calc_age(), 1u) << step;
  }
}

TEST_F(VehicleFlightTest, OnlyANewerAnswerIsFresh) {
  fly(0, {});
  fly(1, {0});
  fly(2, {1});
  for (std::uint64_t step = 3; step < 2 + kHeldSteps; ++step) {
    fly(step, {0, 1});  // answers it already has
    ASSERT_EQ(applied().origin, ForceOrigin::FORCE_HELD) << step;
  }
  fly(2 + kHeldSteps, {0, 1});
  EXPECT_EQ(applied().origin, ForceOrigin::FORCE_FAIL_SAFE);
  fly(3 + kHeldSteps, {2});
  EXPECT_EQ(applied().origin, ForceOrigin::FORCE_HELD)
      << "a newer one, however late, ends the fail-safe";
}

TEST_F(VehicleFlightTest, TheRecordSaysWhichAnswerIsInForce) {
  const bus::PeerId peer{};
  flight_.gate.set_clients({{peer, "late", 0}});
  RecordEntry entry;
  flight_.measure(0, {});
  flight_.gate.expect(0);
  ASSERT_EQ(flight_.gate.offer(make_answer(0), peer), Verdict::kAccepted);
  flight_.take_answer();
  flight_.fill_record(entry);
  EXPECT_EQ(entry.kind(), AnswerKind::ANSWER_ACCEPTED);
  EXPECT_EQ(entry.step(), 0u);
  EXPECT_EQ(entry.answered_step(), 0u);
  EXPECT_STREQ(entry.client_name().c_str(), "late");
  EXPECT_EQ(entry.answer(), make_answer(0).command);
  flight_.actuate();

  flight_.gate.expect(1);
  fly(1, {});
  flight_.fill_record(entry);
  EXPECT_EQ(entry.kind(), AnswerKind::ANSWER_HELD);
  EXPECT_EQ(entry.step(), 1u);
  EXPECT_EQ(entry.answered_step(), 0u);
  EXPECT_EQ(entry.answer(), make_answer(0).command);
  EXPECT_EQ(entry.f_Q_W_n(), make_answer(0).command.f_Q_W_n()) << "which acted before";

  flight_.actuate();
  flight_.gate.expect(2);
  flight_.measure(2, {});
  flight_.fill_record(entry);
  EXPECT_EQ(entry.kind(), AnswerKind::ANSWER_NONE);
  OfferedAnswer refused = make_answer(2);
  refused.command.fault(FaultCode::FAULT_FREE_FALL);
  flight_.gate.offer(refused, peer);
  flight_.fill_record(entry);
  EXPECT_EQ(entry.kind(), AnswerKind::ANSWER_REFUSED);
  EXPECT_EQ(entry.answered_step(), 2u);
  EXPECT_EQ(entry.answer(), refused.command);
}

TEST_F(VehicleFlightTest, ALateAnswerEndsTheAbsence) {
  flight_.measure(0, {});
  flight_.note_waiting(VehicleFlight::Clock::now() - std::chrono::hours(1));
  EXPECT_GE(flight_.calc_absence_s(), 3600.0);
  flight_.keep_late_answer(make_answer(0));
  EXPECT_EQ(flight_.calc_absence_s(), 0.0);
}

TEST_F(VehicleFlightTest, ALateEndIsWithdrawnByANewerAnswer) {
  const bus::PeerId peer{};
  flight_.gate.set_clients({{peer, "late", 0}});
  OfferedAnswer last = make_answer(0);
  last.command.mission(MissionPhase::MISSION_FINISHED);
  fly(0, {});
  EXPECT_FALSE(flight_.has_ended_late());
  flight_.gate.expect(1);
  flight_.measure(1, {});
  flight_.keep_late_answer(last);
  EXPECT_TRUE(flight_.has_ended_late());
  ASSERT_EQ(flight_.gate.offer(make_answer(1), peer), Verdict::kAccepted);
  flight_.take_answer();
  EXPECT_FALSE(flight_.has_ended_late()) << "a newer answer says that the mission goes on";
  flight_.keep_late_answer(last);
  EXPECT_FALSE(flight_.has_ended_late()) << "an older one does not";
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
