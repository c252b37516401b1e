/// A recorder on Eclipse Cyclone DDS: takes every sample of a run, keeps the server within its
/// window, and says at the end what it has. It writes no recording.
///
///     cyclone_recorder [--domain N] [--name TEXT]
///
/// stdout: one JSON object. Exit code 0: every step 0…K of all three streams; 1: not; 2: bad usage.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "node.h"

/// Which steps of a stream have come.
typedef struct Steps {
  uint8_t* has;
  uint64_t size;    ///< of `has`
  uint64_t count;   ///< different steps
  uint64_t copies;  ///< samples of a step that was there
  uint64_t next;    ///< the first one that is not there
} Steps;

static void add_step(Steps* steps, uint64_t step) {
  if (step >= steps->size) {
    const uint64_t size = 2 * step + 1024;
    steps->has = realloc(steps->has, size);
    if (!steps->has) abort();
    memset(steps->has + steps->size, 0, size - steps->size);
    steps->size = size;
  }
  if (steps->has[step]) {
    ++steps->copies;
    return;
  }
  steps->has[step] = 1;
  ++steps->count;
  while (steps->next < steps->size && steps->has[steps->next]) ++steps->next;
}

typedef struct Recorder {
  Node node;
  Options options;
  dds_entity_t state_reader, command_reader, reference_reader;
  uint64_t run_id;
  Steps states, commands, references;
  bool has_last;
  uint64_t last_step;  ///< of the command that finished the mission
  bool is_ready;
} Recorder;

static void take_streams(Recorder* self) {
  static union {
    sls_VehicleState state;
    sls_ControlCommand command;
    sls_Reference reference;
  } sample;
  dds_sample_info_t info;
  while (take(self->state_reader, &sample, &info))
    if (sample.state.run_id == self->run_id) add_step(&self->states, sample.state.step);
  while (take(self->command_reader, &sample, &info)) {
    if (sample.command.run_id != self->run_id) continue;
    add_step(&self->commands, sample.command.step);
    if (sample.command.mission == sls_MISSION_FINISHED) {
      self->has_last = true;
      self->last_step = sample.command.step;
    }
  }
  while (take(self->reference_reader, &sample, &info))
    if (sample.reference.run_id == self->run_id) add_step(&self->references, sample.reference.step);
}

/// All steps before this one are there, of every stream.
static uint64_t calc_next_step(const Recorder* self) {
  uint64_t next = self->states.next;
  if (self->commands.next < next) next = self->commands.next;
  if (self->references.next < next) next = self->references.next;
  return next;
}

static bool has_all(const Recorder* self) {
  return self->has_last && calc_next_step(self) > self->last_step;
}

static void clear_steps(Steps* steps) {
  free(steps->has);
  memset(steps, 0, sizeof *steps);
}

static void join(Recorder* self, const Run* run) {
  clear_steps(&self->states);
  clear_steps(&self->commands);
  clear_steps(&self->references);
  self->has_last = false;
  self->is_ready = false;
  self->run_id = run->parameters.run_id;
  say("takes run %016llx", (unsigned long long)self->run_id);
}

static void announce_recorder(Recorder* self, bool done) {
  const Announcement announcement = {.role = sls_ROLE_RECORDER,
                                     .name = self->options.name,
                                     .ready = self->is_ready,
                                     .done = done,
                                     .last_complete_step = (int64_t)calc_next_step(self) - 1};
  announce(&self->node, find_run(&self->node, self->run_id), &announcement);
}

/// The server and every controller that is there; one at least before the flight.
static bool sees_all_endpoints(const Recorder* self, const Run* run) {
  if (!hears(self->state_reader, &run->server)) return false;
  int controllers = 0;
  for (const Peer* peer = self->node.peers; peer < self->node.peers + self->node.peer_count;
       ++peer) {
    if (peer->announcement.role != sls_ROLE_CONTROLLER ||
        peer->announcement.run_id != self->run_id ||
        !hears(self->node.participant_reader, &peer->id))
      continue;
    if (!hears(self->command_reader, &peer->id) || !hears(self->reference_reader, &peer->id))
      return false;
    ++controllers;
  }
  return controllers > 0 || run->status.phase != sls_PHASE_WAITING;
}

/// Takes samples until all are there, or nothing more can be expected.
static void record(Recorder* self) {
  dds_time_t announced = 0, end = 0;
  while (stop_signal == 0 && !has_all(self)) {
    dds_sleepfor(DDS_MSECS(5));
    look_around(&self->node);
    const Run* run = find_run(&self->node, self->run_id);
    const Run* next = run ? find_successor(&self->node, run) : NULL;
    if (next) join(self, run = next);
    take_streams(self);
    const bool is_over = !run || has_ended(run) || dds_time() - run->heard > kServerDeadline;
    if (is_over && end == 0) end = dds_time() + DDS_SECS(10);
    if (end != 0 && dds_time() > end) return;
    const bool is_now_ready = !self->is_ready && run && sees_all_endpoints(self, run);
    self->is_ready = self->is_ready || is_now_ready;
    if (!is_now_ready && dds_time() - announced < kPollTime) continue;
    announced = dds_time();
    announce_recorder(self, false);
  }
}

static void print_stream(const char* name, const Steps* steps, const char* end) {
  printf("\"%s\": {\"steps\": %llu, \"without_a_hole\": %llu, \"copies\": %llu}%s", name,
         (unsigned long long)steps->count, (unsigned long long)steps->next,
         (unsigned long long)steps->copies, end);
}

static void print_result(const Recorder* self) {
  printf("{\"run_id\": \"%016llx\", \"last_step\": %lld, ", (unsigned long long)self->run_id,
         self->has_last ? (long long)self->last_step : -1LL);
  print_stream("state", &self->states, ", ");
  print_stream("command", &self->commands, ", ");
  print_stream("reference", &self->references, "}\n");
}

int main(int argc, char** argv) {
  static Recorder self = {.options = {.name = "cyclone_recorder"}};
  program_name = "cyclone_recorder";
  read_options(argc, argv, sls_ROLE_RECORDER, &self.options);
  catch_stop_signals();
  open_node(&self.node, &self.options);
  self.state_reader = make_reader(&self.node, &sls_VehicleState_desc, "sls/state", kEverything);
  self.command_reader =
      make_reader(&self.node, &sls_ControlCommand_desc, "sls/command", kEverything);
  self.reference_reader =
      make_reader(&self.node, &sls_Reference_desc, "sls/reference", kEverything);

  const Run* run = wait_for_run(&self.node);
  if (!run) {
    close_node(&self.node);
    return 1;
  }
  join(&self, run);
  record(&self);
  announce_recorder(&self, true);
  print_result(&self);
  close_node(&self.node);
  if (stop_signal != 0) return 128 + stop_signal;
  return has_all(&self) ? 0 : 1;
}
