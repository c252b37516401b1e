/// A controller on Eclipse Cyclone DDS: flies scenarios made of set-points, such as
/// config/scenarios/setpoints.yaml, with the servers and recorders of this project.
///
///     cyclone_controller [--domain N] [--name TEXT] [--strength N]
///
/// It flies vehicle 0, follows resets and servers that take another's place, and ends with its run:
/// exit code 0 finished, 1 failed or nobody there, 2 bad usage.
#include <stdlib.h>
#include <string.h>

#include "node.h"
#include "qsf_law.h"
#include "scenario.h"

typedef struct Controller {
  Node node;
  Options options;
  dds_entity_t state_reader, command_writer, reference_writer, waitset;

  uint64_t run_id;  ///< of the run it flies; 0: none
  bool is_ready;
  Scenario scenario;
  Vehicle vehicle;
  Gains horizontal, vertical;
  int64_t period_ns;

  bool has_answered;
  sls_ControlCommand last;  ///< a state that comes again is answered with the same bytes
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

/// The stage in force at `step`: one is left at the first step at which its time is over. True when
/// that was the last one, which stays in force for this answer.
static bool advance_mission(const Controller* self, uint64_t step, sls_ControllerState* memory) {
  while ((int64_t)(step - memory->stage_start_step) * self->period_ns >=
         self->scenario.stages[memory->stage_index].duration_ns) {
    if (memory->stage_index + 1 == (uint32_t)self->scenario.stage_count) return true;
    ++memory->stage_index;
    memory->stage_start_step = step;
  }
  return false;
}

/// A pure function of the sample: the controller state that came with it is all the memory there
/// is.
static sls_ControlCommand calc_answer(const Controller* self, const sls_VehicleState* state) {
  const dds_time_t began = dds_time();
  sls_ControlCommand command = {.run_id = state->run_id,
                                .vehicle_id = state->vehicle_id,
                                .step = state->step,
                                .strength = self->options.strength,
                                .controller = state->controller};
  COPY_TEXT(command.client_name, self->options.name);
  LawFault fault = kNotFinite;  // also of a damaged sample, which names no stage that can be flown
  bool is_over = false;
  if (command.controller.stage_index < (uint32_t)self->scenario.stage_count &&
      command.controller.stage_start_step <= state->step) {
    is_over = advance_mission(self, state->step, &command.controller);
    Motion motion;
    memcpy(motion.p_WQ, state->p_WQ_m, sizeof motion.p_WQ);
    memcpy(motion.v_WQ, state->v_WQ_m_s, sizeof motion.v_WQ);
    memcpy(motion.p_WL, state->p_WL_m, sizeof motion.p_WL);
    memcpy(motion.v_WL, state->v_WL_m_s, sizeof motion.v_WL);
    fault = calc_force(&motion, self->scenario.stages[command.controller.stage_index].set_point,
                       &self->vehicle, &self->horizontal, &self->vertical, command.f_Q_W_n);
  }
  command.fault = to_message(fault);
  command.mission = fault != kNoFault ? sls_MISSION_FAILED
                    : is_over         ? sls_MISSION_FINISHED
                                      : sls_MISSION_RUNNING;
  command.compute_time_ns = (uint64_t)(dds_time() - began);
  return command;
}

static void write_reference(const Controller* self, const sls_VehicleState* state) {
  const uint32_t stage = self->last.controller.stage_index;
  sls_Reference reference = {.run_id = state->run_id,
                             .vehicle_id = state->vehicle_id,
                             .step = state->step,
                             .sim_time_ns = state->sim_time_ns,
                             .stage_index = stage};
  COPY_TEXT(reference.client_name, self->options.name);
  COPY_TEXT(reference.stage_name, "set_point");
  if (stage < (uint32_t)self->scenario.stage_count)
    memcpy(reference.position_m, self->scenario.stages[stage].set_point,
           sizeof reference.position_m);
  write_sample(self->reference_writer, &reference);
}

static void answer_states(Controller* self) {
  static sls_VehicleState state;
  dds_sample_info_t info;
  while (take(self->state_reader, &state, &info)) {
    if (state.run_id != self->run_id || state.vehicle_id != 0) continue;
    if (!self->has_answered || self->last.step != state.step) {
      self->last = calc_answer(self, &state);
      self->has_answered = true;
      // First, so that a recorder has it should this program be killed after the command.
      write_reference(self, &state);
      if (self->last.fault != sls_FAULT_NONE)
        say("step %llu: fault %d", (unsigned long long)state.step, (int)self->last.fault);
    }
    write_sample(self->command_writer, &self->last);
  }
}

// --- the life of a client ------------------------------------------------------------------------

/// Takes everything it needs to know of a run from what its server says.
static void join(Controller* self, const Run* run) {
  int line = 0;
  if (!parse_scenario(run->parameters.scenario_text, &self->scenario, &line)) {
    say("scenario of run %016llx: line %d: expected set-points flown for a time",
        (unsigned long long)run->parameters.run_id, line);
    exit(2);
  }
  self->vehicle = (Vehicle){.quad_mass = run->parameters.quad_mass_kg,
                            .load_mass = run->parameters.load_mass_kg,
                            .rod_length = run->parameters.rod_length_m,
                            .gravity = run->parameters.gravity_m_s2};
  self->horizontal = calc_horizontal_gains(self->scenario.horizontal_weight);
  self->vertical = calc_vertical_gains(self->scenario.vertical_weight);
  self->period_ns = run->parameters.period_ns;
  self->has_answered = false;
  self->is_ready = false;
  self->run_id = run->parameters.run_id;
  say("'%s' joins run %016llx", self->options.name, (unsigned long long)self->run_id);
  announce_controller(self, false, false);
}

/// The server's endpoints and those of the recorders that the scenario expects.
static bool sees_all_endpoints(const Controller* self, const Run* run) {
  if (!hears(self->state_reader, &run->server) || !reaches(self->command_writer, &run->server))
    return false;
  int recorders = 0;
  for (const Peer* peer = self->node.peers; peer < self->node.peers + self->node.peer_count; ++peer)
    if (peer->announcement.role == sls_ROLE_RECORDER && peer->announcement.run_id == self->run_id &&
        reaches(self->command_writer, &peer->id) && reaches(self->reference_writer, &peer->id))
      ++recorders;
  return recorders >= self->scenario.recorders;
}

/// Answers until the run has ended; false when its server is gone for good.
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
    } else if (!self->is_ready && sees_all_endpoints(self, run)) {
      self->is_ready = true;
      announce_controller(self, true, false);
    } else if (dds_time() - run->heard > kServerDeadline) {
      say("the server of run %016llx is silent", (unsigned long long)self->run_id);
      return false;
    }
  }
  return true;
}

/// True when all recorders that are there have said they hold everything, the expected ones at
/// least.
static bool are_recorders_done(const Controller* self) {
  int done = 0;
  for (const Peer* peer = self->node.peers; peer < self->node.peers + self->node.peer_count;
       ++peer) {
    if (peer->announcement.role != sls_ROLE_RECORDER || peer->announcement.run_id != self->run_id)
      continue;
    if (peer->announcement.done)
      ++done;
    else if (!is_silent(peer->heard))
      return false;
  }
  return done >= self->scenario.recorders;
}

/// Keeps the writers until the recorders have everything, at most 10 s. Returns the exit code.
static int leave(Controller* self, bool has_server) {
  announce_controller(self, false, true);
  dds_wait_for_acks(self->command_writer, DDS_MSECS(500));
  dds_wait_for_acks(self->reference_writer, DDS_MSECS(500));
  const Run* run = current_run(self);
  const bool is_finished = has_server && run && run->status.phase == sls_PHASE_FINISHED;
  const dds_time_t limit = dds_time() + DDS_SECS(10);
  while (is_finished && stop_signal == 0 && dds_time() < limit && !are_recorders_done(self)) {
    dds_sleepfor(kPollTime);
    look_around(&self->node);
  }
  if (run && run->status.phase == sls_PHASE_FAILED) say("the run failed: %s", run->status.reason);
  return is_finished ? 0 : 1;
}

int main(int argc, char** argv) {
  static Controller self = {.options = {.name = "cyclone_controller"}};
  program_name = "cyclone_controller";
  read_options(argc, argv, sls_ROLE_CONTROLLER, &self.options);
  catch_stop_signals();
  open_node(&self.node, &self.options);
  self.state_reader = make_reader(&self.node, &sls_VehicleState_desc, "sls/state", kLoop);
  self.command_writer =
      make_writer(&self.node, &sls_ControlCommand_desc, "sls/command", kStreamDepth);
  self.reference_writer =
      make_writer(&self.node, &sls_Reference_desc, "sls/reference", kStreamDepth);
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
