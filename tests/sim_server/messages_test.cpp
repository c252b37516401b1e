// The samples of server and client. Both programs must read the same values from them.
#include "sim_server/messages.hpp"

#include <gtest/gtest.h>

#include "common/bus/convert.hpp"
#include "common/config/sha256.hpp"
#include "common/plugin/shared_library.hpp"
#include "control_client/messages.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::sim {
namespace {

using Array = std::array<double, 3>;

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

Applied make_distinct_force() {
  Applied applied;
  applied.f_Q_W = {17, 18, 19};
  applied.answer_f_Q_W = {24, 25, 26};
  applied.origin = ForceOrigin::FORCE_HELD;
  applied.controller_name = "pilot";
  applied.memory.stage_index(20);
  applied.memory.numbers({1.5, 2.5});
  return applied;
}

TEST(MessagesTest, AStateHoldsTheMeasurementAndTheAppliedForce) {
  const Applied applied = make_distinct_force();
  const VehicleState message = make_state_message(22, make_distinct_state(), applied);
  EXPECT_EQ(message.vehicle_id(), 22u);
  expect_distinct_state(message.measured());
  EXPECT_EQ(message.f_Q_W_n(), (Array{17, 18, 19}));
  EXPECT_EQ(message.force_origin(), ForceOrigin::FORCE_HELD);
  EXPECT_STREQ(message.controller_name().c_str(), "pilot");
  EXPECT_EQ(message.controller(), applied.memory);
}

TEST(MessagesTest, AtStepZeroNothingWasApplied) {
  const VehicleState message = make_state_message(0, {}, {});
  EXPECT_EQ(message.f_Q_W_n(), (Array{0, 0, 0}));
  EXPECT_EQ(message.force_origin(), ForceOrigin::FORCE_NONE);
  EXPECT_EQ(message.controller_name().size(), 0u);
  EXPECT_EQ(message.controller(), ControllerState());
  EXPECT_EQ(message.measured().q_WB(), (std::array<double, 4>{1, 0, 0, 0})) << "level";
}

TEST(MessagesTest, ARecordEntryHoldsTheTruthAndADifferingMeasurement) {
  model::Measurement truth;
  truth.p_WQ = {27, 28, 29};
  RecordEntry entry;
  const model::Measurement measured = make_distinct_state();
  fill_state(entry, 22, 23, truth, &measured, make_distinct_force());
  EXPECT_EQ(entry.vehicle_id(), 22u);
  EXPECT_EQ(entry.step(), 23u);
  EXPECT_EQ(entry.truth().p_WQ_m(), (Array{27, 28, 29}));
  EXPECT_EQ(entry.f_Q_W_n(), (Array{17, 18, 19}));
  ASSERT_EQ(entry.measured().size(), 1u);
  expect_distinct_state(entry.measured().front());
  fill_state(entry, 22, 24, make_distinct_state(), nullptr, {});
  EXPECT_TRUE(entry.measured().empty()) << "of the entry it was before";
  expect_distinct_state(entry.truth());
}

TEST(MessagesTest, TheClientReadsTheStateTheServerWrote) {
  const model::Measurement state = make_distinct_state();
  const model::Measurement read = bus::to_measurement(make_state_message(0, state, {}).measured());
  EXPECT_EQ(read.p_WQ, state.p_WQ);
  EXPECT_EQ(read.v_WQ, state.v_WQ);
  EXPECT_EQ(read.p_WL, state.p_WL);
  EXPECT_EQ(read.v_WL, state.v_WL);
  EXPECT_EQ(read.rod.alpha, state.rod.alpha);
  EXPECT_EQ(read.rod.beta, state.rod.beta);
  EXPECT_EQ(read.rod.alpha_dot, state.rod.alpha_dot);
  EXPECT_EQ(read.rod.beta_dot, state.rod.beta_dot);
  EXPECT_EQ(read.attitude.q_WB.coeffs(), state.attitude.q_WB.coeffs());
  EXPECT_EQ(read.attitude.w_WB_B, state.attitude.w_WB_B);
  EXPECT_EQ(read.signals, state.signals);
}

/// A plant that turns and publishes signals.
class TurningPlant : public Plant {
 public:
  void advance(const std::vector<Eigen::Vector3d>&, std::int64_t) override {}
  const model::Measurement& measurement(std::size_t) const override { return measurement_; }
  bool has_attitude() const override { return true; }
  std::vector<Signal> signals() const override { return {{"rotor_1_rad_s", "rad/s"}}; }

 private:
  model::Measurement measurement_;
};

TEST(MessagesTest, TheLibraryIsTheLoadedOneWhenAnotherHasTakenTheFilesPlace) {
  const sls::test::TemporaryFolder folder;
  config::Scenario scenario = config::load_scenario(SLS_SOURCE_DIR "/config/scenarios/short.yaml");
  scenario.folder = folder.path();
  scenario.plant.model.name = "mine.so";
  std::filesystem::copy(SLS_LIBRARIES "/empty.so", folder / "mine.so");
  const std::string flown = config::calc_file_sha256(folder / "mine.so");
  const plugin::SharedLibrary library(folder / "mine.so", "plant.model");
  for (int reset = 0; reset < 2; ++reset) {
    EXPECT_EQ(make_parameters_message(31, {0}, scenario, TurningPlant(), "sls 9.9")
                  .library_sha256()
                  .to_string(),
              flown);
    sls::test::write_bytes(folder / "repaired.so", "another");
    std::filesystem::rename(folder / "repaired.so", folder / "mine.so");
  }
}

TEST(MessagesTest, ParametersAreThoseInForce) {
  config::Scenario scenario =
      config::load_scenario(SLS_SOURCE_DIR "/config/scenarios/gazebo_legacy.yaml");
  config::override_period(scenario, 0.001);
  const Parameters message = make_parameters_message(31, {0}, scenario, TurningPlant(), "sls 9.9");
  EXPECT_EQ(message.run_id(), 31u);
  EXPECT_STREQ(message.contract_sha256().c_str(), bus::kContractSha256);
  EXPECT_EQ(message.scenario_text().to_string(), scenario.text);
  EXPECT_EQ(message.scenario_sha256().to_string(), scenario.sha256);
  EXPECT_EQ(message.library_sha256().size(), 0u);
  ASSERT_EQ(message.vehicles().size(), 1u);
  EXPECT_EQ(message.vehicles()[0].vehicle_id(), 0u);
  EXPECT_EQ(message.vehicles()[0].quad_mass_kg(), 1.5);
  EXPECT_EQ(message.vehicles()[0].load_mass_kg(), 0.201);
  EXPECT_EQ(message.vehicles()[0].rod_length_m(), 1.1);
  EXPECT_EQ(message.vehicles()[0].gravity_m_s2(), 9.8066);
  EXPECT_TRUE(message.has_attitude());
  ASSERT_EQ(message.signals().size(), 1u);
  EXPECT_STREQ(message.signals()[0].name().c_str(), "rotor_1_rad_s");
  EXPECT_STREQ(message.signals()[0].unit().c_str(), "rad/s");
  EXPECT_EQ(message.force_limit_n(), scenario.controller.force_limit_n);
  EXPECT_EQ(message.expected_recorders(), 1u);
  EXPECT_EQ(message.period_ns(), 1'000'000);
  EXPECT_EQ(message.step_ns(), 1'000'000);
  EXPECT_EQ(message.mode(), SyncMode::MODE_LOCKSTEP);
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

TEST(MessagesTest, ACommandIsTheWholeAnswer) {
  const ControlCommand message =
      control::make_command_message(72, make_distinct_answer(), std::chrono::nanoseconds(12345));
  EXPECT_EQ(message.vehicle_id(), 72u);
  EXPECT_EQ(message.f_Q_W_n(), (Array{1, 2, 3}));
  EXPECT_EQ(message.controller().stage_index(), 4u);
  EXPECT_EQ(message.controller().stage_start_step(), 5u);
  EXPECT_EQ(message.controller().numbers(), (std::vector<double>{6, 7, 8}));
  EXPECT_EQ(message.mission(), MissionPhase::MISSION_RUNNING);
  EXPECT_EQ(message.fault(), FaultCode::FAULT_NONE);
  EXPECT_EQ(message.compute_time_ns(), 12345u);
  const Reference& reference = message.reference();
  EXPECT_EQ(reference.stage_index(), 24u);
  EXPECT_STREQ(reference.stage_name().c_str(), "eight");
  EXPECT_EQ(reference.position_m(), (Array{9, 10, 11}));
  EXPECT_EQ(reference.velocity_m_s(), (Array{12, 13, 14}));
  EXPECT_EQ(reference.acceleration_m_s2(), (Array{15, 16, 17}));
  EXPECT_EQ(reference.jerk_m_s3(), (Array{18, 19, 20}));
  EXPECT_EQ(reference.snap_m_s4(), (Array{21, 22, 23}));
}

TEST(MessagesTest, EveryFaultAndMissionPhaseHasItsCode) {
  const auto translate = [](control::Fault fault, control::MissionPhase mission) {
    control::Answer answer;
    answer.fault = fault;
    answer.mission = mission;
    const auto message = control::make_command_message(0, answer, {});
    return std::pair(message.fault(), message.mission());
  };
  using control::Fault;
  using Phase = control::MissionPhase;
  EXPECT_EQ(translate(Fault::kNone, Phase::kFinished),
            std::pair(FaultCode::FAULT_NONE, MissionPhase::MISSION_FINISHED));
  EXPECT_EQ(translate(Fault::kFreeFall, Phase::kFailed),
            std::pair(FaultCode::FAULT_FREE_FALL, MissionPhase::MISSION_FAILED));
  EXPECT_EQ(translate(Fault::kRodLevel, Phase::kFailed),
            std::pair(FaultCode::FAULT_ROD_LEVEL, MissionPhase::MISSION_FAILED));
  EXPECT_EQ(translate(Fault::kNotFinite, Phase::kFailed),
            std::pair(FaultCode::FAULT_NOT_FINITE, MissionPhase::MISSION_FAILED));
  EXPECT_EQ(translate(Fault::kStageTimeout, Phase::kFailed),
            std::pair(FaultCode::FAULT_STAGE_TIMEOUT, MissionPhase::MISSION_FAILED));
}

TEST(MessagesTest, ControllerMemorySurvivesTheWayThroughCommandAndState) {
  const control::Answer answer = make_distinct_answer();
  const ControlCommand command = control::make_command_message(0, answer, {});
  Applied applied;
  applied.memory = command.controller();
  const VehicleState next = make_state_message(0, {}, applied);
  const control::ControllerMemory memory = control::to_memory(next.controller());
  EXPECT_EQ(memory.stage, answer.memory.stage);
  EXPECT_EQ(memory.stage_start_step, answer.memory.stage_start_step);
  EXPECT_EQ(memory.numbers, answer.memory.numbers);
}

}  // namespace
}  // namespace sls::sim
