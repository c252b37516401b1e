#include "node.h"

#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { kMaxMatched = 64 };

volatile int stop_signal = 0;
const char* program_name = "cyclone";

static void keep_signal(int signal) { stop_signal = signal; }

void catch_stop_signals(void) {
  struct sigaction action = {.sa_handler = keep_signal};
  sigaction(SIGINT, &action, NULL);
  sigaction(SIGTERM, &action, NULL);
}

void say(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  fprintf(stderr, "%s: ", program_name);
  vfprintf(stderr, format, arguments);
  fputc('\n', stderr);
  va_end(arguments);
}

void copy_text(char* to, size_t size, const char* text) { snprintf(to, size, "%s", text); }

/// Returns the `result` of Cyclone's `call`; an error ends the program.
static int32_t expect(int32_t result, const char* call) {
  if (result >= 0) return result;
  say("%s: expected success, got %s", call, dds_strretcode(result));
  exit(1);
}

// --- endpoints -----------------------------------------------------------------------------------

static dds_entity_t make_topic(Node* node, const dds_topic_descriptor_t* type, const char* topic) {
  return expect(dds_create_topic(node->participant, type, topic, NULL, NULL), topic);
}

dds_entity_t make_reader(Node* node, const dds_topic_descriptor_t* type, const char* topic,
                         Reading reading) {
  dds_qos_t* qos = dds_create_qos();
  if (reading == kLoop) {
    dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
    dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, kLoopDepth);
  } else {
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(5));
    dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
    dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  }
  const dds_entity_t reader =
      expect(dds_create_reader(node->participant, make_topic(node, type, topic), qos, NULL), topic);
  dds_delete_qos(qos);
  return reader;
}

dds_entity_t make_writer(Node* node, const dds_topic_descriptor_t* type, const char* topic,
                         int depth) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(5));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
  // The QoS that the server's reader of commands requests in real time (profile
  // sls_realtime_command_reader); also matches a reader without a deadline.
  if (strcmp(topic, "sls/command") == 0) dds_qset_deadline(qos, DDS_MSECS(100));
  const dds_entity_t writer =
      expect(dds_create_writer(node->participant, make_topic(node, type, topic), qos, NULL), topic);
  dds_delete_qos(qos);
  return writer;
}

void read_options(int argc, char** argv, sls_ParticipantRole role, Options* options) {
  const bool flies = role == sls_ROLE_CONTROLLER;
  for (int i = 1; i < argc; i += 2) {
    if (i + 1 < argc && strcmp(argv[i], "--domain") == 0) {
      options->domain = (uint32_t)strtoul(argv[i + 1], NULL, 10);
    } else if (i + 1 < argc && strcmp(argv[i], "--name") == 0) {
      options->name = argv[i + 1];
    } else if (flies && i + 1 < argc && strcmp(argv[i], "--strength") == 0) {
      options->strength = (int32_t)strtol(argv[i + 1], NULL, 10);
    } else if (!flies && i + 1 < argc && strcmp(argv[i], "--out") == 0) {
      options->folder = argv[i + 1];
    } else {
      say("expected --domain N, --name TEXT or --%s, got '%s'", flies ? "strength N" : "out DIR",
          argv[i]);
      exit(2);
    }
  }
  if (flies || options->folder) return;
  say("expected --out DIR, got none");
  exit(2);
}

void open_node(Node* node, const Options* options) {
  memset(node, 0, sizeof *node);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_entity_name(qos, options->name);
  node->participant =
      expect(dds_create_participant(options->domain, qos, NULL), "dds_create_participant");
  dds_delete_qos(qos);
  node->parameters_reader = make_reader(node, &sls_Parameters_desc, "sls/parameters", kEverything);
  node->status_reader = make_reader(node, &sls_SimStatus_desc, "sls/status", kEverything);
  node->participant_writer =
      make_writer(node, &sls_Participant_desc, "sls/participant", kLatchedDepth);
}

// Cyclone waits up to 1 s for each writer whose readers have not acknowledged everything.
void close_node(Node* node) { dds_delete(node->participant); }

bool take(dds_entity_t reader, void* sample, dds_sample_info_t* info) {
  while (expect(dds_take(reader, &sample, info, 1, 1), "dds_take") > 0)
    if (info->valid_data) return true;
  return false;
}

void write_sample(dds_entity_t writer, const void* sample) {
  expect(dds_write(writer, sample), "dds_write");
}

// --- participants and runs -----------------------------------------------------------------------

static bool is_same(const dds_guid_t* a, const dds_guid_t* b) {
  return memcmp(a, b, sizeof *a) == 0;
}

typedef dds_return_t (*ListMatched)(dds_entity_t, dds_instance_handle_t*, size_t);
typedef dds_builtintopic_endpoint_t* (*DescribeMatched)(dds_entity_t, dds_instance_handle_t);

static bool is_matched(dds_entity_t endpoint, const dds_guid_t* participant, ListMatched list,
                       DescribeMatched describe) {
  dds_instance_handle_t handles[kMaxMatched];
  int count = expect(list(endpoint, handles, kMaxMatched), "dds_get_matched");
  bool found = false;
  for (int i = 0; i < count && i < kMaxMatched && !found; ++i) {
    dds_builtintopic_endpoint_t* other = describe(endpoint, handles[i]);
    if (!other) continue;  // it has just left
    found = is_same(&other->participant_key, participant);
    dds_builtintopic_free_endpoint(other);
  }
  return found;
}

bool reaches(dds_entity_t writer, const dds_guid_t* participant) {
  return is_matched(writer, participant, dds_get_matched_subscriptions,
                    dds_get_matched_subscription_data);
}

bool hears(dds_entity_t reader, const dds_guid_t* participant) {
  return is_matched(reader, participant, dds_get_matched_publications,
                    dds_get_matched_publication_data);
}

/// Finds the DDS participant that wrote a sample; false when it has left.
static bool find_sender(dds_entity_t reader, const dds_sample_info_t* info, dds_guid_t* sender) {
  dds_builtintopic_endpoint_t* writer =
      dds_get_matched_publication_data(reader, info->publication_handle);
  if (!writer) return false;
  *sender = writer->participant_key;
  dds_builtintopic_free_endpoint(writer);
  return true;
}

static Run* find_or_add_run(Node* node, uint64_t run_id) {
  Run* oldest = &node->runs[0];
  for (Run* run = node->runs; run < node->runs + node->run_count; ++run) {
    if (run->parameters.run_id == run_id) return run;
    if (run->heard < oldest->heard) oldest = run;
  }
  Run* added = node->run_count < kMaxRuns ? &node->runs[node->run_count++] : oldest;
  memset(added, 0, sizeof *added);
  added->parameters.run_id = run_id;
  return added;
}

static void note_parameters(Node* node, const sls_Parameters* parameters,
                            const dds_guid_t* server) {
  if (strcmp(parameters->contract_sha256, SLS_CONTRACT_SHA256) != 0) {
    say("contract of a server: expected %s, got %s", SLS_CONTRACT_SHA256,
        parameters->contract_sha256);
    return;
  }
  Run* run = find_or_add_run(node, parameters->run_id);
  if (run->vehicle_count > 0 && !is_same(&run->server, server)) return;  // another's run
  run->server = *server;
  run->heard = dds_time();
  run->parameters = *parameters;
  run->vehicle_count = parameters->vehicles._length;
  memcpy(run->vehicles, parameters->vehicles._buffer, run->vehicle_count * sizeof run->vehicles[0]);
  memset(&run->parameters.vehicles, 0, sizeof run->parameters.vehicles);
  memset(&run->parameters.signals, 0, sizeof run->parameters.signals);
}

void look_around(Node* node) {
  // Static, because they are large and Cyclone reuses the buffers of their sequences.
  static sls_Parameters parameters;
  static sls_SimStatus status;
  dds_sample_info_t info;
  dds_guid_t sender;
  while (take(node->parameters_reader, &parameters, &info))
    if (find_sender(node->parameters_reader, &info, &sender))
      note_parameters(node, &parameters, &sender);
  while (take(node->status_reader, &status, &info)) {
    Run* run = find_or_add_run(node, status.run_id);
    // The sender is unknown once it has left, and the server before the parameters have come.
    const bool has_sender = find_sender(node->status_reader, &info, &sender);
    if (run->vehicle_count > 0 && has_sender && !is_same(&run->server, &sender)) continue;
    run->status = status;
    run->has_status = true;
    run->heard = dds_time();
  }
}

bool is_silent(dds_time_t heard) { return dds_time() - heard > kPresumedDeadAfter; }

bool has_ended(const Run* run) {
  return run->status.phase == sls_PHASE_FINISHED || run->status.phase == sls_PHASE_FAILED;
}

const Run* find_run(const Node* node, uint64_t run_id) {
  for (const Run* run = node->runs; run < node->runs + node->run_count; ++run)
    if (run->parameters.run_id == run_id) return run;
  return NULL;
}

/// Progress of a run: 1 waiting, 2 running or paused; 0 if it cannot be joined.
static int calc_progress(const Run* run) {
  if (!run->has_status || run->vehicle_count == 0 || is_silent(run->heard)) return 0;
  if (run->status.phase == sls_PHASE_WAITING) return 1;
  return run->status.phase == sls_PHASE_RUNNING || run->status.phase == sls_PHASE_PAUSED ? 2 : 0;
}

const Run* find_joinable_run(const Node* node) {
  const Run* best = NULL;
  for (const Run* run = node->runs; run < node->runs + node->run_count; ++run) {
    const int progress = calc_progress(run), best_progress = best ? calc_progress(best) : 0;
    if (progress > best_progress ||
        (best && progress == best_progress && run->parameters.run_id < best->parameters.run_id))
      best = run;
  }
  return best;
}

const Run* wait_for_run(Node* node) {
  const dds_time_t limit = dds_time() + kJoinTime;
  while (stop_signal == 0) {
    look_around(node);
    const Run* run = find_joinable_run(node);
    if (run) return run;
    if (dds_time() > limit) {
      say("no server within %d s", (int)(kJoinTime / DDS_SECS(1)));
      return NULL;
    }
    dds_sleepfor(kPollTime);
  }
  return NULL;
}

const Run* find_successor(const Node* node, const Run* run) {
  if (run->status.phase != sls_PHASE_RESET && !is_silent(run->heard)) return NULL;
  const Run* next = find_joinable_run(node);
  return next && next->parameters.run_id != run->parameters.run_id ? next : NULL;
}

void announce(Node* node, const Run* run, const Announcement* announcement) {
  static uint32_t ids[kMaxVehicles];
  sls_Participant message = {
      .contract_sha256 = SLS_CONTRACT_SHA256,
      .role = announcement->role,
      .strength = announcement->strength,
      .ready = announcement->ready,
      .done = announcement->done,
      .last_complete_step = announcement->last_complete_step,
  };
  COPY_TEXT(message.name, announcement->name);
  if (run) {
    message.run_id = run->parameters.run_id;
    COPY_TEXT(message.scenario_sha256, run->parameters.scenario_sha256);
  }
  if (run && announcement->role == sls_ROLE_CONTROLLER) {
    for (uint32_t i = 0; i < run->vehicle_count; ++i) ids[i] = run->vehicles[i].vehicle_id;
    message.vehicle_ids._buffer = ids;
    message.vehicle_ids._length = run->vehicle_count;
  }
  if (gethostname(message.host, sizeof message.host - 1) != 0) COPY_TEXT(message.host, "unknown");
  write_sample(node->participant_writer, &message);
}
