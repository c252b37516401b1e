#include "scenario.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/// True for lines that a set-point controller does not need, or reads as numbers from
/// sls/parameters.
static bool is_of_no_concern(const char* line) {
  static const char* const beginnings[] = {
      "#",       "name: ",      "vehicles: ",        "vehicle: {",
      "plant:",  "  pendulum:", "  step_s: ",        "  initial: {",
      "sync: {", "controller:", "  force_limit_n: ", "mission:"};
  for (size_t i = 0; i < sizeof beginnings / sizeof beginnings[0]; ++i)
    if (strncmp(line, beginnings[i], strlen(beginnings[i])) == 0) return true;
  return *line == '\0';
}

static bool parse_line(const char* line, Scenario* scenario) {
  int end = 0;
  Stage* next = &scenario->stages[scenario->stage_count];
  double* p = next->set_point;
  double seconds = 0;
  if (is_of_no_concern(line)) return true;
  if (sscanf(line, " gains: { lqr: { horizontal: %lf, vertical: %lf } }%n",
             &scenario->horizontal_weight, &scenario->vertical_weight, &end) == 2 &&
      end > 0)
    return line[end] == '\0';
  if (scenario->stage_count == kMaxStages) return false;
  if (sscanf(line, " - set_point: { position_m: [%lf, %lf, %lf] }%n", &p[0], &p[1], &p[2], &end) ==
          3 &&
      end > 0)
    return line[end] == '\0';
  if (sscanf(line, " for_s: %lf%n", &seconds, &end) == 1 && line[end] == '\0') {
    next->duration_ns = (int64_t)llround(seconds * 1e9);
    ++scenario->stage_count;
    return true;
  }
  return false;
}

bool parse_scenario(const char* text, Scenario* scenario, int* line) {
  memset(scenario, 0, sizeof *scenario);
  *line = 0;
  while (*text != '\0') {
    char buffer[256];
    const size_t length = strcspn(text, "\n");
    ++*line;
    if (length >= sizeof buffer) return false;
    memcpy(buffer, text, length);
    buffer[length] = '\0';
    if (!parse_line(buffer, scenario)) return false;
    text += length + (text[length] == '\n');
  }
  *line = 0;
  return scenario->stage_count > 0 && scenario->horizontal_weight > 0 &&
         scenario->vertical_weight > 0;
}
