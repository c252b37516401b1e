/// A recorder on Eclipse Cyclone DDS: takes the batches of a run, announces its progress to the
/// server, and writes the same rows as this project's recorder, for plants without attitude, noise
/// and signals.
///
///     cyclone_recorder [--domain N] [--name TEXT] --out DIR
///
/// DIR: state.csv, command.csv, reference.csv. stdout: one JSON object. Exit code 0: every step of
/// a finished run; 1: not; 2: bad usage.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "csv.h"
#include "node.h"

typedef struct Recorder {
  Node node;
  Options options;
  dds_entity_t batch_reader;
  uint64_t run_id;
  int64_t period_ns;
  bool is_ready;
  bool has_batch, has_last;   ///< received: any batch; the last batch
  uint64_t next_batch;        ///< index after the last received batch
  uint64_t batches, entries;  ///< numbers received
  uint64_t missing_batches;   ///< before the last received
  /// For each vehicle of the run: the step after its last row. `missing_steps` counts gaps before
  /// it.
  sls_VehicleParameters vehicles[kMaxVehicles];
  uint64_t next_step[kMaxVehicles];
  uint32_t vehicle_count;
  uint64_t missing_steps;
  CsvFile states, commands, references;
} Recorder;

// --- rows ----------------------------------------------------------------------------------------

static void add_vector(CsvFile* file, const double vector[3]) {
  for (int i = 0; i < 3; ++i) add_number(file, vector[i]);
}

static void begin_row(CsvFile* file, const sls_RecordEntry* entry) {
  add_integer(file, entry->vehicle_id);
  add_integer(file, entry->step);
}

static double calc_time(const Recorder* self, const sls_RecordEntry* entry) {
  return (double)((int64_t)entry->step * self->period_ns) / 1e9;
}

static void write_state(Recorder* self, const sls_RecordEntry* entry) {
  CsvFile* file = &self->states;
  const sls_PlantState* truth = &entry->truth;
  begin_row(file, entry);
  add_number(file, calc_time(self, entry));
  add_vector(file, truth->p_WQ_m);
  add_vector(file, truth->v_WQ_m_s);
  add_vector(file, truth->p_WL_m);
  add_vector(file, truth->v_WL_m_s);
  add_number(file, truth->alpha_rad);
  add_number(file, truth->beta_rad);
  add_number(file, truth->alpha_dot_rad_s);
  add_number(file, truth->beta_dot_rad_s);
  add_vector(file, entry->f_Q_W_n);
  end_row(file);
}

static const char* name_fault(const sls_RecordEntry* entry) {
  static const char* const names[] = {"none", "free_fall", "rod_level", "not_finite",
                                      "stage_timeout"};
  if (entry->kind == sls_ANSWER_HELD) return "held";
  if (entry->kind == sls_ANSWER_FAIL_SAFE) return "fail_safe";
  return names[entry->answer.fault];
}

static bool is_unanswered(const sls_RecordEntry* entry) {
  return entry->kind == sls_ANSWER_HELD || entry->kind == sls_ANSWER_FAIL_SAFE;
}

static void write_command(Recorder* self, const sls_RecordEntry* entry) {
  CsvFile* file = &self->commands;
  begin_row(file, entry);
  add_text(file, entry->client_name);
  add_vector(file, entry->answer.f_Q_W_n);
  add_number(file, is_unanswered(entry) ? 0.0 : (double)entry->answer.compute_time_ns / 1e3);
  add_text(file, name_fault(entry));
  end_row(file);
}

/// The row of a late answer follows rows of later steps. The project's recorder sorts it in.
static void write_reference(Recorder* self, const sls_RecordEntry* entry) {
  CsvFile* file = &self->references;
  const sls_Reference* reference = &entry->answer.reference;
  begin_row(file, entry);
  add_number(file, calc_time(self, entry));
  add_integer(file, reference->stage_index);
  add_text(file, reference->stage_name);
  add_vector(file, reference->position_m);
  add_vector(file, reference->velocity_m_s);
  add_vector(file, reference->acceleration_m_s2);
  add_vector(file, reference->jerk_m_s3);
  add_vector(file, reference->snap_m_s4);
  end_row(file);
}

static void add_entry(Recorder* self, const sls_RecordEntry* entry) {
  uint32_t i = 0;
  while (i < self->vehicle_count && self->vehicles[i].vehicle_id != entry->vehicle_id) ++i;
  if (i == self->vehicle_count) return;
  ++self->entries;
  if (entry->kind == sls_ANSWER_LATE) {
    write_reference(self, entry);
    return;
  }
  if (entry->step < self->next_step[i]) return;
  self->missing_steps += entry->step - self->next_step[i];
  self->next_step[i] = entry->step + 1;
  write_state(self, entry);
  if (entry->kind == sls_ANSWER_NONE) return;
  write_command(self, entry);
  if (!is_unanswered(entry)) write_reference(self, entry);
}

// --- batches -------------------------------------------------------------------------------------

/// A reliable reader gets the batches of a writer in order. A late reader gets those in its
/// history.
static void take_batches(Recorder* self) {
  static sls_RecordBatch batch;
  dds_sample_info_t info;
  while (take(self->batch_reader, &batch, &info)) {
    if (batch.run_id != self->run_id) continue;
    if (self->has_batch && batch.batch_index < self->next_batch) continue;
    if (self->has_batch) self->missing_batches += batch.batch_index - self->next_batch;
    self->has_batch = true;
    self->next_batch = batch.batch_index + 1;
    self->has_last = self->has_last || batch.is_last;
    ++self->batches;
    for (uint32_t i = 0; i < batch.entries._length; ++i) add_entry(self, &batch.entries._buffer[i]);
  }
}

/// Last step up to which all rows of all vehicles were received; −1: none.
static int64_t find_last_step(const Recorder* self) {
  uint64_t next = self->vehicle_count > 0 ? self->next_step[0] : 0;
  for (uint32_t i = 1; i < self->vehicle_count; ++i)
    if (self->next_step[i] < next) next = self->next_step[i];
  return (int64_t)next - 1;
}

static bool has_all(const Recorder* self, const Run* run) {
  return self->has_last && run && has_ended(run);
}

static void open_files(Recorder* self) {
  static const char reference_names[][24] = {"ref_?_m", "ref_v?_m_s", "ref_a?_m_s2", "ref_j?_m_s3",
                                             "ref_s?_m_s4"};
  open_csv(&self->states, self->options.folder, "state.csv",
           "vehicle_id,step,sim_time_s,quad_x_m,quad_y_m,quad_z_m,quad_vx_m_s,quad_vy_m_s,"
           "quad_vz_m_s,load_x_m,load_y_m,load_z_m,load_vx_m_s,load_vy_m_s,load_vz_m_s,alpha_rad,"
           "beta_rad,alpha_dot_rad_s,beta_dot_rad_s,force_x_n,force_y_n,force_z_n");
  open_csv(&self->commands, self->options.folder, "command.csv",
           "vehicle_id,step,controller,force_x_n,force_y_n,force_z_n,compute_us,fault");
  char header[512] = "vehicle_id,step,sim_time_s,stage,stage_name";
  for (size_t i = 0; i < sizeof reference_names / sizeof reference_names[0]; ++i)
    for (const char* axis = "xyz"; *axis; ++axis) {
      char name[sizeof reference_names[0]];
      memcpy(name, reference_names[i], sizeof name);
      *strchr(name, '?') = *axis;
      strcat(strcat(header, ","), name);
    }
  open_csv(&self->references, self->options.folder, "reference.csv", header);
}

static void close_files(Recorder* self) {
  close_csv(&self->states);
  close_csv(&self->commands);
  close_csv(&self->references);
}

// --- joining and recording a run -----------------------------------------------------------------

/// Starts to record `run`. Its files replace those of the previous run.
static void join(Recorder* self, const Run* run) {
  if (self->run_id != 0) {
    close_files(self);
    dds_delete(self->batch_reader);  // it may have dropped batches of this run
  }
  open_files(self);
  self->batch_reader = make_reader(&self->node, &sls_RecordBatch_desc, "sls/record", kEverything);
  self->run_id = run->parameters.run_id;
  self->period_ns = run->parameters.period_ns;
  self->is_ready = self->has_batch = self->has_last = false;
  self->next_batch = self->batches = self->entries = 0;
  self->missing_batches = self->missing_steps = 0;
  self->vehicle_count = run->vehicle_count;
  memcpy(self->vehicles, run->vehicles, sizeof self->vehicles);
  memset(self->next_step, 0, sizeof self->next_step);
  say("takes run %016llx", (unsigned long long)self->run_id);
}

static void announce_recorder(Recorder* self, bool done) {
  const Announcement announcement = {.role = sls_ROLE_RECORDER,
                                     .name = self->options.name,
                                     .ready = self->is_ready,
                                     .done = done,
                                     .last_complete_step = find_last_step(self)};
  announce(&self->node, find_run(&self->node, self->run_id), &announcement);
}

/// Takes batches until all are received, or until 10 s after the end of the run or its server.
static void record(Recorder* self) {
  dds_time_t announced = 0, end = 0;
  while (stop_signal == 0) {
    dds_sleepfor(DDS_MSECS(5));
    look_around(&self->node);
    const Run* run = find_run(&self->node, self->run_id);
    const Run* next = run ? find_successor(&self->node, run) : NULL;
    if (next) join(self, run = next);
    take_batches(self);
    if (has_all(self, run)) return;
    const bool is_over = !run || has_ended(run) || dds_time() - run->heard > kServerDeadline;
    if (is_over && end == 0) end = dds_time() + DDS_SECS(10);
    if (end != 0 && dds_time() > end) return;
    const bool is_now_ready = !self->is_ready && run && hears(self->batch_reader, &run->server) &&
                              hears(self->node.status_reader, &run->server);
    self->is_ready = self->is_ready || is_now_ready;
    if (!is_now_ready && dds_time() - announced < kPollTime) continue;
    announced = dds_time();
    announce_recorder(self, false);
  }
}

int main(int argc, char** argv) {
  static Recorder self = {.options = {.name = "cyclone_recorder"}};
  program_name = "cyclone_recorder";
  read_options(argc, argv, sls_ROLE_RECORDER, &self.options);
  catch_stop_signals();
  open_node(&self.node, &self.options);
  const Run* run = wait_for_run(&self.node);
  if (!run) {
    close_node(&self.node);
    return 1;
  }
  join(&self, run);
  record(&self);
  close_files(&self);
  announce_recorder(&self, true);
  run = find_run(&self.node, self.run_id);
  const bool is_complete = has_all(&self, run) && run->status.phase == sls_PHASE_FINISHED &&
                           self.missing_steps == 0 && self.missing_batches == 0;
  printf(
      "{\"run_id\": \"%016llx\", \"last_step\": %lld, \"batches\": %llu, \"entries\": %llu, "
      "\"missing_batches\": %llu, \"missing_steps\": %llu, \"complete\": %s}\n",
      (unsigned long long)self.run_id, (long long)find_last_step(&self),
      (unsigned long long)self.batches, (unsigned long long)self.entries,
      (unsigned long long)self.missing_batches, (unsigned long long)self.missing_steps,
      is_complete ? "true" : "false");
  close_node(&self.node);
  if (stop_signal != 0) return 128 + stop_signal;
  return is_complete ? 0 : 1;
}
