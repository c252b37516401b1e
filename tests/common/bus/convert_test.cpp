// Both programs must read the same values from a sample.
#include "common/bus/convert.hpp"

#include <gtest/gtest.h>

#include "tests/common/bus/sample_messages.hpp"

namespace sls::bus {
namespace {

using Array = std::array<double, 3>;

TEST(ConvertTest, VectorsKeepTheirOrder) {
  EXPECT_EQ(to_array({1, 2, 3}), (Array{1, 2, 3}));
  EXPECT_EQ(to_vector({1, 2, 3}), Eigen::Vector3d(1, 2, 3));
}

model::Measurement make_distinct_state() {
  model::Measurement state;
  state.p_WQ = {1, 2, 3};
  state.v_WQ = {4, 5, 6};
  state.p_WL = {7, 8, 9};
  state.v_WL = {10, 11, 12};
  state.rod = {0.13, 0.14, 0.15, 0.16};
  state.attitude.q_WB = Eigen::Quaterniond(0.5, -0.5, 0.1, 0.7);
  state.attitude.w_WB_B = {31, 32, 33};
  state.signals.resize(2);
  state.signals << 34, 35;
  return state;
}

void expect_distinct_state(const PlantState& message) {
  EXPECT_EQ(message.p_WQ_m(), (Array{1, 2, 3}));
  EXPECT_EQ(message.v_WQ_m_s(), (Array{4, 5, 6}));
  EXPECT_EQ(message.p_WL_m(), (Array{7, 8, 9}));
  EXPECT_EQ(message.v_WL_m_s(), (Array{10, 11, 12}));
  EXPECT_EQ(message.alpha_rad(), 0.13);
  EXPECT_EQ(message.beta_rad(), 0.14);
  EXPECT_EQ(message.alpha_dot_rad_s(), 0.15);
  EXPECT_EQ(message.beta_dot_rad_s(), 0.16);
  EXPECT_EQ(message.q_WB(), (std::array<double, 4>{0.5, -0.5, 0.1, 0.7})) << "w, x, y, z";
  EXPECT_EQ(message.w_WB_B_rad_s(), (Array{31, 32, 33}));
  EXPECT_EQ(message.signals(), (std::vector<double>{34, 35}));
}

TEST(ConvertTest, AStateHoldsTheMeasurementAndTheForceThatActed) {
  model::StepRecord record;
  record.vehicle_id = 22;
  record.measured = make_distinct_state();
  record.f_Q_W = {17, 18, 19};
  record.kind = model::AnswerKind::kHeld;
  record.client_name = "pilot";
  record.answer.memory.stage = 20;
  record.answer.memory.stage_start_step = 21;
  record.answer.memory.numbers = Eigen::Vector2d(1.5, 2.5);
  VehicleState message;
  fill(message, record);
  EXPECT_EQ(message.vehicle_id(), 22u);
  expect_distinct_state(message.measured());
  EXPECT_EQ(message.f_Q_W_n(), (Array{17, 18, 19}));
  EXPECT_EQ(message.force_origin(), ForceOrigin::FORCE_HELD);
  EXPECT_STREQ(message.controller_name().c_str(), "pilot");
  const model::ControllerMemory memory = to_memory(message.controller());
  EXPECT_EQ(memory.stage, 20u);
  EXPECT_EQ(memory.stage_start_step, 21u);
  EXPECT_EQ(memory.numbers, record.answer.memory.numbers);
}

TEST(ConvertTest, AtStepZeroNothingWasApplied) {
  VehicleState message;
  fill(message, model::StepRecord());
  EXPECT_EQ(message.f_Q_W_n(), (Array{0, 0, 0}));
  EXPECT_EQ(message.force_origin(), ForceOrigin::FORCE_NONE);
  EXPECT_EQ(message.controller_name().size(), 0u);
  EXPECT_EQ(message.controller(), ControllerState());
  EXPECT_EQ(message.measured().q_WB(), (std::array<double, 4>{1, 0, 0, 0})) << "level";
}

TEST(ConvertTest, TheClientReadsTheStateTheServerWrote) {
  PlantState message, again;
  fill(message, make_distinct_state());
  fill(again, to_measurement(message));
  EXPECT_EQ(again, message);
}

TEST(ConvertTest, ARecordEntryIsTheSameAfterTheWayThroughAStepRecord) {
  model::StepRecord record;  // each one over the one before
  RecordEntry again;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const auto batch = test::make_message<RecordBatch>(seed);
    for (RecordEntry entry : batch.entries()) {
      entry.answer().vehicle_id(entry.vehicle_id());
      if (entry.vehicle_id() % 3 == 0) entry.measured().clear();
      fill(record, entry);
      EXPECT_EQ(&record.seen(), entry.measured().empty() ? &record.truth : &*record.measured);
      fill(again, record);
      EXPECT_EQ(again, entry);
    }
  }
}

TEST(ConvertTest, AnEnumeratorThatTheContractDoesNotDefineKeepsItsNumber) {
  ControlCommand command;
  command.mission(static_cast<MissionPhase>(7));
  command.fault(static_cast<FaultCode>(0xffffffffU));
  model::Answer answer;
  fill(answer, command);
  EXPECT_EQ(static_cast<std::uint32_t>(answer.mission), 7u);
  EXPECT_STREQ(to_string(answer.error_code), "unknown");
  ControlCommand again;
  fill(again, 0, answer);
  EXPECT_EQ(again, command);
}

}  // namespace
}  // namespace sls::bus
