/// A controller on Eclipse Cyclone DDS: flies scenarios made of set-points, such as
/// config/scenarios/setpoints.yaml, with the servers and recorders of this project.
///
///     cyclone_controller [--domain N] [--name TEXT] [--strength N]
///
/// It flies all vehicles of its server, follows resets and replacement servers, and ends with its
/// run. Exit code 0: finished; 1: failed or no server; 2: bad usage.
#include <stdlib.h>
#include <string.h>

#include "node.h"
#include "qsf_law.h"
#include "scenario.h"

typedef struct Controller {
  Node node;
  Options options;
  dds_entity_t state_reader, command_writer, waitset;

  uint64_t run_id;  ///< current run; 0: none
  bool is_ready;
  Scenario scenario;
  Gains horizontal, vertical;
  int64_t period_ns;
} Controller;

static const Run* current_run(const Controller* self) {
  return self->run_id != 0 ? find_run(&self->node, self->run_id) : NULL;
}

static void announce_controller(Controller* self, bool ready, bool done) {
  const Announcement announcement = {.role = sls_ROLE_CONTROLLER,
                                     .name = self->options.name,
                                     .strength = self->options.strength,
                                     .ready = ready,
                                     .done = done,
                                     .last_complete_step = -1};
  announce(&self->node, current_run(self), &announcement);
}

// --- one answer ----------------------------------------------------------------------------------

static sls_FaultCode to_message(LawFault fault) {
  switch (fault) {
    case kNoFault:
      return sls_FAULT_NONE;
    case kFreeFall:
      return sls_FAULT_FREE_FALL;
    case kRodLevel:
      return sls_FAULT_ROD_LEVEL;
    case kNotFinite:
      break;
  }
  return sls_FAULT_NOT_FINITE;
}

/// Advances to the stage of `step`: a stage ends at the first step at which its time is over. True
/// when the last stage has ended; this answer still uses it.
static bool advance_mission(const Controller* self, uint64_t step, sls_ControllerState* memory) {
  while ((int64_t)(step - memory->stage_start_step) * self->period_ns >=
         self->scenario.stages[memory->stage_index].duration_ns) {
    if (memory->stage_index + 1 == (uint32_t)self->scenario.stage_count) return true;
    ++memory->stage_index;
    memory->stage_start_step = step;
  }
  return false;
}

/// A pure function of `state`. The only memory is the controller state in `state`.
static sls_ControlCommand calc_answer(const Controller* self, const sls_VehicleParameters* vehicle,
                                      uint64_t step, const sls_VehicleState* state) {
  const dds_time_t began = dds_time();
  sls_ControlCommand command = {.vehicle_id = state->vehicle_id, .controller = state->controller};
  LawFault fault = kNotFinite;  // also for a damaged sample, which has an invalid stage
  bool is_over = false;
  sls_ControllerState* memory = &command.controller;  // this law needs no memory numbers
  if (memory->stage_index < (uint32_t)self->scenario.stage_count &&
      memory->stage_start_step <= step) {
    is_over = advance_mission(self, step, memory);
    const double* set_point = self->scenario.stages[memory->stage_index].set_point;
    const Vehicle model = {.quad_mass = vehicle->quad_mass_kg,
                           .load_mass = vehicle->load_mass_kg,
                           .rod_length = vehicle->rod_length_m,
                           .gravity = vehicle->gravity_m_s2};
    Motion motion;
    memcpy(motion.p_WQ, state->measured.p_WQ_m, sizeof motion.p_WQ);
    memcpy(motion.v_WQ, state->measured.v_WQ_m_s, sizeof motion.v_WQ);
    memcpy(motion.p_WL, state->measured.p_WL_m, sizeof motion.p_WL);
    memcpy(motion.v_WL, state->measured.v_WL_m_s, sizeof motion.v_WL);
    fault =
        calc_force(&motion, set_point, &model, &self->horizontal, &self->vertical, command.f_Q_W_n);
    memcpy(command.reference.position_m, set_point, sizeof command.reference.position_m);
  }
  command.reference.stage_index = memory->stage_index;
  COPY_TEXT(command.reference.stage_name, "set_point");
  command.fault = to_message(fault);
  command.mission = fault != kNoFault ? sls_MISSION_FAILED
                    : is_over         ? sls_MISSION_FINISHED
                                      : sls_MISSION_RUNNING;
  command.compute_time_ns = (uint64_t)(dds_time() - began);
  return command;
}

static const sls_VehicleParameters* find_vehicle(const Run* run, uint32_t id) {
  for (uint32_t i = 0; i < run->vehicle_count; ++i)
    if (run->vehicles[i].vehicle_id == id) return &run->vehicles[i];
  return NULL;
}

/// Answers a sample of states with a sample of commands, also if it was sent again.
static void answer(const Controller* self, const Run* run, const sls_States* states) {
  static sls_ControlCommand answers[sls_SAMPLE_VEHICLES];
  sls_Commands commands = {.run_id = states->run_id,
                           .step = states->step,
                           .strength = self->options.strength,
                           .vehicles = {._buffer = answers}};
  COPY_TEXT(commands.client_name, self->options.name);
  for (uint32_t i = 0; i < states->vehicles._length; ++i) {
    const sls_VehicleState* state = &states->vehicles._buffer[i];
    const sls_VehicleParameters* vehicle = find_vehicle(run, state->vehicle_id);
    if (!vehicle) continue;
    sls_ControlCommand* command = &answers[commands.vehicles._length++];
    *command = calc_answer(self, vehicle, states->step, state);
    if (command->fault != sls_FAULT_NONE)
      say("step %llu: fault %d", (unsigned long long)states->step, (int)command->fault);
  }
  if (commands.vehicles._length > 0) write_sample(self->command_writer, &commands);
}

static void answer_states(const Controller* self) {
  static sls_States states;
  dds_sample_info_t info;
  const Run* run = current_run(self);
  while (take(self->state_reader, &states, &info))
    if (run && states.run_id == self->run_id) answer(self, run, &states);
}

// --- joining and leaving a run -------------------------------------------------------------------

/// Reads the scenario and all settings of a run from the parameters that its server sent.
static void join(Controller* self, const Run* run) {
  int line = 0;
  if (!parse_scenario(run->parameters.scenario_text, &self->scenario, &line)) {
    say("scenario of run %016llx: line %d: expected set-points flown for a time",
        (unsigned long long)run->parameters.run_id, line);
    exit(2);
  }
  self->horizontal = calc_horizontal_gains(self->scenario.horizontal_weight);
  self->vertical = calc_vertical_gains(self->scenario.vertical_weight);
  self->period_ns = run->parameters.period_ns;
  self->is_ready = false;
  self->run_id = run->parameters.run_id;
  say("'%s' joins run %016llx", self->options.name, (unsigned long long)self->run_id);
  announce_controller(self, false, false);
}

/// Answers until the run has ended; false when its server is gone.
static bool serve(Controller* self) {
  dds_time_t looked = 0;
  while (stop_signal == 0) {
    dds_waitset_wait(self->waitset, NULL, 0, kPollTime);
    answer_states(self);
    if (dds_time() - looked < kPollTime) continue;
    looked = dds_time();
    look_around(&self->node);
    const Run* run = current_run(self);
    if (!run || has_ended(run)) return run != NULL;
    const Run* next = find_successor(&self->node, run);
    if (next) {
      join(self, next);
    } else if (!self->is_ready && hears(self->state_reader, &run->server) &&
               reaches(self->command_writer, &run->server)) {
      self->is_ready = true;
      announce_controller(self, true, false);
    } else if (dds_time() - run->heard > kServerDeadline) {
      say("the server of run %016llx is silent", (unsigned long long)self->run_id);
      return false;
    }
  }
  return true;
}

/// Announces that it is done. Returns the exit code.
static int leave(Controller* self, bool has_server) {
  announce_controller(self, false, true);
  const Run* run = current_run(self);
  if (run && run->status.phase == sls_PHASE_FAILED) say("the run failed: %s", run->status.reason);
  return has_server && run && run->status.phase == sls_PHASE_FINISHED ? 0 : 1;
}

int main(int argc, char** argv) {
  static Controller self = {.options = {.name = "cyclone_controller"}};
  program_name = "cyclone_controller";
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
    join(&self, run);
    code = leave(&self, serve(&self));
  }
  close_node(&self.node);
  return stop_signal != 0 ? 128 + stop_signal : code;
}
