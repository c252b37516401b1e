/// A foreign controller on Eclipse Cyclone DDS, with types compiled as @appendable. It
/// creates its endpoints, prints "begins" and waits for SIGTERM.
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "dds/dds.h"
#include "sls.h"

static volatile sig_atomic_t is_over = 0;

static void end(int signal) {
  (void)signal;
  is_over = 1;
}

static dds_entity_t expect(dds_entity_t entity, const char* what) {
  if (entity < 0) {
    fprintf(stderr, "appendable_client: %s: %s\n", what, dds_strretcode(entity));
    exit(1);
  }
  return entity;
}

int main(int argc, char** argv) {
  const struct sigaction action = {.sa_handler = end};
  sigaction(SIGTERM, &action, NULL);
  const dds_domainid_t domain = argc > 1 ? (dds_domainid_t)strtoul(argv[1], NULL, 10) : 0;

  dds_qos_t* qos = dds_create_qos();
  dds_qset_entity_name(qos, "appendable");
  const dds_entity_t participant =
      expect(dds_create_participant(domain, qos, NULL), "dds_create_participant");
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(5));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  const dds_entity_t announcements = expect(
      dds_create_topic(participant, &sls_Participant_desc, "sls/participant", NULL, NULL), "topic");
  const dds_entity_t commands =
      expect(dds_create_topic(participant, &sls_Commands_desc, "sls/command", NULL, NULL), "topic");
  const dds_entity_t states =
      expect(dds_create_topic(participant, &sls_States_desc, "sls/state", NULL, NULL), "topic");
  expect(dds_create_writer(participant, announcements, qos, NULL), "sls/participant");
  expect(dds_create_writer(participant, commands, qos, NULL), "sls/command");
  dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  expect(dds_create_reader(participant, states, qos, NULL), "sls/state");
  dds_delete_qos(qos);

  puts("begins");
  fflush(stdout);
  while (!is_over) usleep(10000);
  dds_delete(participant);
  return 0;
}
