/// The values of a scenario like config/scenarios/setpoints.yaml. A server sends the text in
/// sls/parameters: a client needs no file.
#pragma once

#include <stdbool.h>
#include <stdint.h>

enum { kMaxStages = 32 };

typedef struct Stage {
  double set_point[3];  ///< of the load, m
  int64_t duration_ns;
} Stage;

typedef struct Scenario {
  double horizontal_weight, vertical_weight;  ///< of the LQR gains
  Stage stages[kMaxStages];
  int stage_count;
} Scenario;

/// Parses a list of set-points, each with a duration, and LQR gains. Returns false for any other
/// line and sets `line` to its number (0: no stage, no gains or no end of a stage).
bool parse_scenario(const char* text, Scenario* scenario, int* line);
