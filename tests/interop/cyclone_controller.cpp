/// The project's controller on Eclipse Cyclone DDS: only the wire is another vendor's, so a flight
/// has the bytes of one with our own DDS.
///
///     cyclone_controller [--domain N] [--name TEXT] [--strength N]
///
/// It flies all vehicles of its server, follows resets and replacement servers, and ends with its
/// run. Exit code 0: finished; 1: failed or no server; 2: bad usage.
#include <algorithm>
#include <cstdlib>
#include <map>

#include "control_client/flight_controller.hpp"
extern "C" {
#include "tests/interop/node.h"
}

namespace {

using sls::control::FlightController;

struct Controller {
  Node node;
  Options options;
  dds_entity_t state_reader, command_writer, waitset;

  uint64_t run_id;  ///< current run; 0: none
  bool is_ready;
  std::map<uint32_t, FlightController> vehicles;  ///< of the run
};

const Run* current_run(const Controller& self) {
  return self.run_id != 0 ? find_run(&self.node, self.run_id) : nullptr;
}

void announce_controller(Controller& self, bool ready, bool done) {
  Announcement announcement{};
  announcement.role = sls_ROLE_CONTROLLER;
  announcement.name = self.options.name;
  announcement.strength = self.options.strength;
  announcement.ready = ready;
  announcement.done = done;
  announcement.last_complete_step = -1;
  announce(&self.node, current_run(self), &announcement);
}

// --- one answer ----------------------------------------------------------------------------------

Eigen::Vector3d to_vector(const double (&array)[3]) { return Eigen::Vector3d(array); }

void copy(const Eigen::Vector3d& vector, double (&to)[3]) {
  std::copy(vector.begin(), vector.end(), to);
}

sls::model::Measurement to_measurement(const sls_PlantState& sample) {
  sls::model::Measurement state;
  state.p_WQ = to_vector(sample.p_WQ_m);
  state.v_WQ = to_vector(sample.v_WQ_m_s);
  state.p_WL = to_vector(sample.p_WL_m);
  state.v_WL = to_vector(sample.v_WL_m_s);
  state.rod = {sample.alpha_rad, sample.beta_rad, sample.alpha_dot_rad_s, sample.beta_dot_rad_s};
  return state;
}

/// A pure function of `state`. `numbers` are those of the command's memory.
sls_ControlCommand calc_answer(const FlightController& controller, uint64_t step,
                               const sls_VehicleState& state, sls::model::Numbers& numbers) {
  const dds_time_t began = dds_time();
  const auto& sequence = state.controller.numbers;
  const sls::model::ControllerMemory memory = {
      state.controller.stage_index, state.controller.stage_start_step,
      Eigen::Map<const Eigen::VectorXd>(sequence._buffer, sequence._length)};
  const auto answer = controller.calc_answer(step, to_measurement(state.measured), memory);
  sls_ControlCommand command{};
  command.vehicle_id = state.vehicle_id;
  copy(answer.f_Q_W, command.f_Q_W_n);
  command.reference.stage_index = answer.stage;
  COPY_TEXT(command.reference.stage_name, answer.stage_name.c_str());
  copy(answer.reference.position, command.reference.position_m);
  copy(answer.reference.velocity, command.reference.velocity_m_s);
  copy(answer.reference.acceleration, command.reference.acceleration_m_s2);
  copy(answer.reference.jerk, command.reference.jerk_m_s3);
  copy(answer.reference.snap, command.reference.snap_m_s4);
  numbers = answer.memory.numbers;
  command.controller.stage_index = answer.memory.stage;
  command.controller.stage_start_step = answer.memory.stage_start_step;
  command.controller.numbers._buffer = numbers.data();
  command.controller.numbers._length = static_cast<uint32_t>(numbers.size());
  command.mission = static_cast<sls_MissionPhase>(answer.mission);
  command.fault = static_cast<sls_FaultCode>(answer.error_code);
  command.compute_time_ns = static_cast<uint64_t>(dds_time() - began);
  return command;
}

/// Answers a sample of states with a sample of commands, also if it was sent again.
void answer(const Controller& self, const sls_States& states) {
  static sls_ControlCommand answers[sls_SAMPLE_VEHICLES];
  static sls::model::Numbers numbers[sls_SAMPLE_VEHICLES];
  sls_Commands commands{};
  commands.run_id = states.run_id;
  commands.step = states.step;
  commands.strength = self.options.strength;
  commands.vehicles._buffer = answers;
  COPY_TEXT(commands.client_name, self.options.name);
  for (uint32_t i = 0; i < states.vehicles._length; ++i) {
    const sls_VehicleState& state = states.vehicles._buffer[i];
    const auto vehicle = self.vehicles.find(state.vehicle_id);
    if (vehicle == self.vehicles.end()) continue;
    const uint32_t count = commands.vehicles._length++;
    answers[count] = calc_answer(vehicle->second, states.step, state, numbers[count]);
  }
  if (commands.vehicles._length > 0) write_sample(self.command_writer, &commands);
}

void answer_states(const Controller& self) {
  static sls_States states;
  dds_sample_info_t info;
  while (take(self.state_reader, &states, &info))
    if (states.run_id == self.run_id) answer(self, states);
}

// --- joining and leaving a run -------------------------------------------------------------------

/// Reads the scenario and the settings of a run from the parameters that its server sent.
void join(Controller& self, const Run& run) {
  auto scenario = sls::config::parse_scenario(run.parameters.scenario_text, "sls/parameters");
  scenario.sync.period_ns = run.parameters.period_ns;
  scenario.plant.step_ns = run.parameters.step_ns;
  self.vehicles.clear();
  for (uint32_t i = 0; i < run.vehicle_count; ++i) {
    const uint32_t id = run.vehicles[i].vehicle_id;
    self.vehicles.emplace(id,
                          FlightController(sls::config::make_vehicle_scenario(scenario, id), id));
  }
  self.is_ready = false;
  self.run_id = run.parameters.run_id;
  say("'%s' joins run %016llx", self.options.name, static_cast<unsigned long long>(self.run_id));
  announce_controller(self, false, false);
}

/// Answers until the run has ended; false when its server is gone.
bool serve(Controller& self) {
  dds_time_t looked = 0;
  while (stop_signal == 0) {
    dds_waitset_wait(self.waitset, nullptr, 0, kPollTime);
    answer_states(self);
    if (dds_time() - looked < kPollTime) continue;
    looked = dds_time();
    look_around(&self.node);
    const Run* run = current_run(self);
    if (!run || has_ended(run)) return run != nullptr;
    if (const Run* next = find_successor(&self.node, run)) {
      join(self, *next);
    } else if (!self.is_ready && hears(self.state_reader, &run->server) &&
               reaches(self.command_writer, &run->server)) {
      self.is_ready = true;
      announce_controller(self, true, false);
    } else if (dds_time() - run->heard > kServerDeadline) {
      say("the server of run %016llx is silent", static_cast<unsigned long long>(self.run_id));
      return false;
    }
  }
  return true;
}

/// Announces that it is done. Returns the exit code.
int leave(Controller& self, bool has_server) {
  announce_controller(self, false, true);
  const Run* run = current_run(self);
  if (run && run->status.phase == sls_PHASE_FAILED) say("the run failed: %s", run->status.reason);
  return has_server && run && run->status.phase == sls_PHASE_FINISHED ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  static Controller self;
  program_name = self.options.name = "cyclone_controller";
  read_options(argc, argv, sls_ROLE_CONTROLLER, &self.options);
  catch_stop_signals();
  open_node(&self.node, &self.options);
  self.state_reader = make_reader(&self.node, &sls_States_desc, "sls/state", kLoop);
  self.command_writer = make_writer(&self.node, &sls_Commands_desc, "sls/command", kLoopDepth);
  self.waitset = dds_create_waitset(self.node.participant);
  dds_waitset_attach(self.waitset, dds_create_readcondition(self.state_reader, DDS_ANY_STATE), 0);

  const Run* run = wait_for_run(&self.node);
  int code = 1;
  if (run) {
    join(self, *run);
    code = leave(self, serve(self));
  }
  close_node(&self.node);
  return stop_signal != 0 ? 128 + stop_signal : code;
}
