// The force on a vehicle in real time when answers are late, and the beginning of absence.
#include "sim_server/core/step/vehicle.hpp"

#include <gtest/gtest.h>

#include "common/config/scenario.hpp"

namespace sls::sim {
namespace {

using model::AnswerKind;
using namespace std::chrono_literals;

constexpr std::uint64_t kRun = 7;
constexpr std::uint64_t kHeldSteps = 125;  // max_hold_s 0.5 at 4 ms

sync::Time at(sync::Duration time) { return sync::Time(time); }

class VehicleTest : public testing::Test {
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
    answer.answer.f_Q_W.z() = -16.0 - 0.001 * static_cast<double>(step);
    answer.answer.stage = 7;
    return answer;
  }

  /// Flies `step` without an answer to it. The answers to the steps `late` arrive during it.
  void fly(std::uint64_t step, const std::vector<std::uint64_t>& late) {
    begin(step);
    for (const std::uint64_t answered : late) vehicle_.keep_late_answer(make_answer(answered));
    vehicle_.fly_without_answer(vehicle_.decide(scenario_.sync, 0.0, {}));
  }
  void begin(std::uint64_t step) {
    record_.step = step;
    vehicle_.begin_step();
  }
  const model::StepRecord& record() const { return vehicle_.record(); }

  model::StepRecord record_;
  const config::Scenario scenario_ = load_realtime();
  Vehicle vehicle_{scenario_, kRun, record_};
};

TEST_F(VehicleTest, TheRecordOfALateAnswerHoldsIt) {
  const OfferedAnswer late = make_answer(3);
  begin(5);
  const model::StepRecord made = make_late_record(vehicle_, late);
  EXPECT_EQ(made.kind, AnswerKind::kLate);
  EXPECT_EQ(made.step, 3u);
  EXPECT_EQ(made.answered_step, 3u);
  EXPECT_EQ(made.client_name, "late");
  EXPECT_EQ(made.answer.f_Q_W, late.answer.f_Q_W);
  EXPECT_EQ(made.answer.stage, 7u);
}

TEST_F(VehicleTest, AnswersThatAreAllOnePeriodLateFlyItWithoutEnd) {
  fly(0, {});
  for (std::uint64_t step = 1; step < 4 * kHeldSteps; ++step) {
    fly(step, {step - 1});
    ASSERT_EQ(record().kind, AnswerKind::kHeld) << step;
    ASSERT_EQ(record().answer.f_Q_W, make_answer(step - 1).answer.f_Q_W) << step;
    ASSERT_EQ(vehicle_.calc_age(), 1u) << step;
  }
}

TEST_F(VehicleTest, OnlyANewerAnswerIsFresh) {
  fly(0, {});
  fly(1, {0});
  fly(2, {1});
  for (std::uint64_t step = 3; step < 2 + kHeldSteps; ++step) {
    fly(step, {0, 1});  // answers it already has
    ASSERT_EQ(record().kind, AnswerKind::kHeld) << step;
  }
  fly(2 + kHeldSteps, {0, 1});
  EXPECT_EQ(record().kind, AnswerKind::kFailSafe);
  fly(3 + kHeldSteps, {2});
  EXPECT_EQ(record().kind, AnswerKind::kHeld) << "a newer one, however late, ends the fail-safe";
}

TEST_F(VehicleTest, TheRecordSaysWhichAnswerIsInForce) {
  const bus::PeerId peer{};
  vehicle_.gate.set_clients({{peer, "late", 0}});
  begin(0);
  vehicle_.gate.expect(0);
  ASSERT_EQ(vehicle_.gate.offer(make_answer(0), peer), Verdict::kAccepted);
  vehicle_.take_answer();
  EXPECT_EQ(record().kind, AnswerKind::kAccepted);
  EXPECT_EQ(record().step, 0u);
  EXPECT_EQ(record().answered_step, 0u);
  EXPECT_EQ(record().client_name, "late");
  EXPECT_EQ(record().answer.f_Q_W, make_answer(0).answer.f_Q_W);
  EXPECT_EQ(record().answer.stage, 7u);

  vehicle_.gate.expect(1);
  fly(1, {});
  EXPECT_EQ(record().kind, AnswerKind::kHeld);
  EXPECT_EQ(record().step, 1u);
  EXPECT_EQ(record().answered_step, 0u);
  EXPECT_EQ(record().answer.f_Q_W, make_answer(0).answer.f_Q_W);
  vehicle_.complete_record();
  EXPECT_EQ(record().kind, AnswerKind::kHeld) << "the step is settled";

  vehicle_.gate.expect(2);
  begin(2);
  vehicle_.complete_record();
  EXPECT_EQ(record().kind, AnswerKind::kNone);
  EXPECT_EQ(record().client_name, "");
  OfferedAnswer refused = make_answer(2);
  refused.answer.error_code = model::ErrorCode::kFreeFall;
  vehicle_.gate.offer(refused, peer);
  vehicle_.complete_record();
  EXPECT_EQ(record().kind, AnswerKind::kRefused);
  EXPECT_EQ(record().answered_step, 2u);
  EXPECT_EQ(record().answer.error_code, model::ErrorCode::kFreeFall);
}

TEST_F(VehicleTest, ALateAnswerEndsTheAbsence) {
  begin(0);
  vehicle_.note_waiting(at(1s));
  EXPECT_EQ(vehicle_.calc_absence_s(at(3s)), 2.0);
  vehicle_.keep_late_answer(make_answer(0));
  EXPECT_EQ(vehicle_.calc_absence_s(at(4s)), 0.0);
}

TEST_F(VehicleTest, RefusalsLastUntilAnAnswerIsValid) {
  vehicle_.note_refused(true, at(1s));
  vehicle_.note_refused(true, at(2s));
  EXPECT_EQ(vehicle_.calc_refused_s(at(3s)), 2.0);
  vehicle_.note_refused(false, at(4s));
  EXPECT_EQ(vehicle_.calc_refused_s(at(5s)), 0.0);
}

TEST_F(VehicleTest, ALateEndIsWithdrawnByANewerAnswer) {
  const bus::PeerId peer{};
  vehicle_.gate.set_clients({{peer, "late", 0}});
  OfferedAnswer last = make_answer(0);
  last.answer.mission = model::MissionPhase::kFinished;
  fly(0, {});
  EXPECT_FALSE(vehicle_.has_ended_late());
  vehicle_.gate.expect(1);
  begin(1);
  vehicle_.keep_late_answer(last);
  EXPECT_TRUE(vehicle_.has_ended_late());
  ASSERT_EQ(vehicle_.gate.offer(make_answer(1), peer), Verdict::kAccepted);
  vehicle_.take_answer();
  EXPECT_FALSE(vehicle_.has_ended_late()) << "a newer answer says that the mission goes on";
  vehicle_.keep_late_answer(last);
  EXPECT_FALSE(vehicle_.has_ended_late()) << "an older one does not";
}

TEST_F(VehicleTest, APauseIsNoAbsence) {
  vehicle_.note_rest(1h);
  EXPECT_EQ(vehicle_.calc_absence_s(at(1h)), 0.0);
  begin(0);
  vehicle_.note_waiting(at(0h));
  vehicle_.note_rest(1h);
  EXPECT_EQ(vehicle_.calc_absence_s(at(2h)), 3600.0);
}

}  // namespace
}  // namespace sls::sim
