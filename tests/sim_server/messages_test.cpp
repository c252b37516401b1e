// What server and client put into their samples, and that both read it back alike.
#include "sim_server/messages.hpp"

#include <gtest/gtest.h>

#include "control_client/messages.hpp"

namespace sls::sim {
namespace {

using Array = std::array<double, 3>;

model::SlungLoadState make_distinct_state() {
  model::SlungLoadState state;
  state.p_WQ = {1, 2, 3};
  state.v_WQ = {4, 5, 6};
  state.p_WL = {7, 8, 9};
  state.v_WL = {10, 11, 12};
  state.rod = {0.13, 0.14, 0.15, 0.16};
  return state;
}

TEST(MessagesTest, AStateSampleHoldsTheStateAndWhatWasApplied) {
  Applied applied;
  applied.f_Q_W = {17, 18, 19};
  applied.answer_f_Q_W = {24, 25, 26};
  applied.origin = FORCE_HELD;
  applied.controller_name = "pilot";
  applied.memory.stage_index(20);
  model::SlungLoadState truth = make_distinct_state();
  truth.p_WQ = {27, 28, 29};
  truth.rod.beta_dot = 30;
  const VehicleState message =
      make_state_message(21, 22, 23, 4'000'000, make_distinct_state(), truth, applied);
  EXPECT_EQ(message.run_id(), 21u);
  EXPECT_EQ(message.vehicle_id(), 22u);
  EXPECT_EQ(message.step(), 23u);
  EXPECT_EQ(message.sim_time_ns(), 92'000'000);
  EXPECT_EQ(message.p_WQ_m(), (Array{1, 2, 3}));
  EXPECT_EQ(message.v_WQ_m_s(), (Array{4, 5, 6}));
  EXPECT_EQ(message.p_WL_m(), (Array{7, 8, 9}));
  EXPECT_EQ(message.v_WL_m_s(), (Array{10, 11, 12}));
  EXPECT_EQ(message.alpha_rad(), 0.13);
  EXPECT_EQ(message.beta_rad(), 0.14);
  EXPECT_EQ(message.alpha_dot_rad_s(), 0.15);
  EXPECT_EQ(message.beta_dot_rad_s(), 0.16);
  EXPECT_EQ(message.f_Q_W_n(), (Array{17, 18, 19}));
  EXPECT_EQ(message.force_origin(), FORCE_HELD);
  EXPECT_STREQ(message.controller_name().c_str(), "pilot");
  EXPECT_EQ(message.controller(), applied.memory);
  EXPECT_EQ(message.answer_f_Q_W_n(), (Array{24, 25, 26}));
  EXPECT_EQ(message.truth().p_WQ_m(), (Array{27, 28, 29}));
  EXPECT_EQ(message.truth().v_WL_m_s(), (Array{10, 11, 12}));
  EXPECT_EQ(message.truth().alpha_rad(), 0.13);
  EXPECT_EQ(message.truth().beta_dot_rad_s(), 30);
}

TEST(MessagesTest, AtStepZeroNothingWasApplied) {
  const VehicleState message = make_state_message(1, 0, 0, 4'000'000, {}, {}, {});
  EXPECT_EQ(message.sim_time_ns(), 0);
  EXPECT_EQ(message.f_Q_W_n(), (Array{0, 0, 0}));
  EXPECT_EQ(message.force_origin(), FORCE_NONE);
  EXPECT_EQ(message.controller_name().size(), 0u);
  EXPECT_EQ(message.controller(), ControllerState());
}

TEST(MessagesTest, SimulationTimeIsWholeNanosecondsOverLongRuns) {
  const VehicleState message = make_state_message(1, 0, 1'000'000'000'000, 999'983, {}, {}, {});
  EXPECT_EQ(message.sim_time_ns(), 999'983'000'000'000'000);
}

TEST(MessagesTest, TheClientReadsTheStateTheServerWrote) {
  const model::SlungLoadState state = make_distinct_state();
  const model::SlungLoadState read =
      control::to_model_state(make_state_message(1, 0, 5, 1'000'000, state, {}, {}));
  EXPECT_EQ(read.p_WQ, state.p_WQ);
  EXPECT_EQ(read.v_WQ, state.v_WQ);
  EXPECT_EQ(read.p_WL, state.p_WL);
  EXPECT_EQ(read.v_WL, state.v_WL);
  EXPECT_EQ(read.rod.alpha, state.rod.alpha);
  EXPECT_EQ(read.rod.beta, state.rod.beta);
  EXPECT_EQ(read.rod.alpha_dot, state.rod.alpha_dot);
  EXPECT_EQ(read.rod.beta_dot, state.rod.beta_dot);
}

TEST(MessagesTest, ParametersAreThoseInForce) {
  config::Scenario scenario =
      config::load_scenario(SLS_SOURCE_DIR "/config/scenarios/gazebo_legacy.yaml");
  config::override_period(scenario, 0.001);
  const Parameters message = make_parameters_message(31, {2}, scenario, "sls 9.9");
  EXPECT_EQ(message.run_id(), 31u);
  EXPECT_EQ(message.vehicle_id(), 2u);
  EXPECT_EQ(message.vehicle_ids(), std::vector<std::uint32_t>{2});
  EXPECT_EQ(message.scenario_text().to_string(), scenario.text);
  EXPECT_EQ(message.scenario_sha256().to_string(), scenario.sha256);
  EXPECT_EQ(message.quad_mass_kg(), 1.5);
  EXPECT_EQ(message.load_mass_kg(), 0.201);
  EXPECT_EQ(message.rod_length_m(), 1.1);
  EXPECT_EQ(message.gravity_m_s2(), 9.8066);
  EXPECT_EQ(message.period_ns(), 1'000'000);
  EXPECT_EQ(message.step_ns(), 1'000'000);
  EXPECT_EQ(message.mode(), MODE_LOCKSTEP);
  EXPECT_EQ(message.real_time_factor(), 0.0);
  EXPECT_STREQ(message.version().c_str(), "sls 9.9");
}

// --- the client's samples ------------------------------------------------------------------------

control::Answer make_distinct_answer() {
  control::Answer answer;
  answer.f_Q_W = {1, 2, 3};
  answer.memory.stage = 4;
  answer.memory.stage_start_step = 5;
  answer.memory.numbers = Eigen::Vector3d(6, 7, 8);
  answer.reference.position = {9, 10, 11};
  answer.reference.velocity = {12, 13, 14};
  answer.reference.acceleration = {15, 16, 17};
  answer.reference.jerk = {18, 19, 20};
  answer.reference.snap = {21, 22, 23};
  answer.stage = 24;
  answer.stage_name = "eight";
  return answer;
}

VehicleState make_answered() { return make_state_message(71, 72, 73, 4'000'000, {}, {}, {}); }

TEST(MessagesTest, ACommandAnswersItsStateSample) {
  const ControlCommand message = control::make_command_message(
      make_answered(), make_distinct_answer(), "pilot", -3, std::chrono::nanoseconds(12345));
  EXPECT_EQ(message.run_id(), 71u);
  EXPECT_EQ(message.vehicle_id(), 72u);
  EXPECT_EQ(message.step(), 73u);
  EXPECT_EQ(message.f_Q_W_n(), (Array{1, 2, 3}));
  EXPECT_STREQ(message.client_name().c_str(), "pilot");
  EXPECT_EQ(message.strength(), -3);
  EXPECT_EQ(message.controller().stage_index(), 4u);
  EXPECT_EQ(message.controller().stage_start_step(), 5u);
  EXPECT_EQ(message.controller().integral_m_s(), (Array{6, 7, 8}));
  EXPECT_EQ(message.mission(), MISSION_RUNNING);
  EXPECT_EQ(message.fault(), FAULT_NONE);
  EXPECT_EQ(message.compute_time_ns(), 12345u);
}

TEST(MessagesTest, EveryFaultAndMissionPhaseHasItsCode) {
  const auto translate = [](control::Fault fault, control::MissionPhase mission) {
    control::Answer answer;
    answer.fault = fault;
    answer.mission = mission;
    const auto message = control::make_command_message({}, answer, "", 0, {});
    return std::pair(message.fault(), message.mission());
  };
  using control::Fault;
  using Phase = control::MissionPhase;
  EXPECT_EQ(translate(Fault::kNone, Phase::kFinished), std::pair(FAULT_NONE, MISSION_FINISHED));
  EXPECT_EQ(translate(Fault::kFreeFall, Phase::kFailed),
            std::pair(FAULT_FREE_FALL, MISSION_FAILED));
  EXPECT_EQ(translate(Fault::kRodLevel, Phase::kFailed),
            std::pair(FAULT_ROD_LEVEL, MISSION_FAILED));
  EXPECT_EQ(translate(Fault::kNotFinite, Phase::kFailed),
            std::pair(FAULT_NOT_FINITE, MISSION_FAILED));
  EXPECT_EQ(translate(Fault::kStageTimeout, Phase::kFailed),
            std::pair(FAULT_STAGE_TIMEOUT, MISSION_FAILED));
}

TEST(MessagesTest, AReferenceSampleHoldsAllDerivativesAndItsStage) {
  const Reference message =
      control::make_reference_message(make_answered(), make_distinct_answer(), "pilot");
  EXPECT_EQ(message.run_id(), 71u);
  EXPECT_EQ(message.vehicle_id(), 72u);
  EXPECT_EQ(message.step(), 73u);
  EXPECT_EQ(message.sim_time_ns(), 292'000'000);
  EXPECT_STREQ(message.client_name().c_str(), "pilot");
  EXPECT_EQ(message.stage_index(), 24u);
  EXPECT_STREQ(message.stage_name().c_str(), "eight");
  EXPECT_EQ(message.position_m(), (Array{9, 10, 11}));
  EXPECT_EQ(message.velocity_m_s(), (Array{12, 13, 14}));
  EXPECT_EQ(message.acceleration_m_s2(), (Array{15, 16, 17}));
  EXPECT_EQ(message.jerk_m_s3(), (Array{18, 19, 20}));
  EXPECT_EQ(message.snap_m_s4(), (Array{21, 22, 23}));
}

TEST(MessagesTest, ControllerMemorySurvivesTheWayThroughCommandAndState) {
  const control::Answer answer = make_distinct_answer();
  const ControlCommand command = control::make_command_message({}, answer, "pilot", 0, {});
  Applied applied;
  applied.memory = command.controller();
  const VehicleState next = make_state_message(1, 0, 1, 1'000'000, {}, {}, applied);
  const control::ControllerMemory memory = control::to_memory(next.controller(), 3);
  EXPECT_EQ(memory.stage, answer.memory.stage);
  EXPECT_EQ(memory.stage_start_step, answer.memory.stage_start_step);
  EXPECT_EQ(memory.numbers, answer.memory.numbers);
}

}  // namespace
}  // namespace sls::sim
