// A plant that stays at its initial position. `parameters` can select an error:
//   { do: WHAT, in: create, advance, measure or destroy, at: STEP }
// Macros define the invalid tables of functions.
#include <cstdio>
#include <memory>

#include "sim_server/plants/shared_library/sls_plant.h"
#include "tests/common/plugin/misbehaviour.hpp"

#ifndef TEST_VERSION
#define TEST_VERSION SLS_PLANT_VERSION
#endif
#ifndef TEST_TABLE_SIZE
#define TEST_TABLE_SIZE sizeof(sls_plant_functions)
#endif
#ifndef TEST_SETUP_SIZE
#define TEST_SETUP_SIZE sizeof(sls_plant_setup)
#endif
#ifndef TEST_STATE_SIZE
#define TEST_STATE_SIZE sizeof(sls_plant_state)
#endif
#ifndef TEST_SIGNAL_COUNT
#define TEST_SIGNAL_COUNT 2
#endif
#ifndef TEST_SIGNAL_NAME
#define TEST_SIGNAL_NAME "steps"
#endif
#ifndef TEST_MEASURE
#define TEST_MEASURE &measure
#endif
#ifndef TEST_RESULT
#define TEST_RESULT &functions
#endif

namespace {

using sls::test::find_parameter;

struct Plant {
  std::string what, where;
  std::int64_t at = 0, step = 0;
  sls_plant_state state;
  double held_force_z_n = 0.0;
};

void* create(const sls_plant_setup* setup, char* error, std::size_t error_size) {
  const std::string parameters = setup->parameters;
  auto plant = std::make_unique<Plant>();
  plant->what = find_parameter(parameters, "do");
  plant->where = find_parameter(parameters, "in");
  plant->at = std::strtoll(find_parameter(parameters, "at").c_str(), nullptr, 10);
  plant->state = setup->initial;
  if (plant->where == "create") {
    sls::test::misbehave(plant->what);
    if (plant->what == "say the parameters")
      std::snprintf(error, error_size, "%s", setup->parameters);
    return nullptr;
  }
  return plant.release();
}

void destroy(void* plant) {
  const std::unique_ptr<Plant> self(static_cast<Plant*>(plant));
  if (self->where == "destroy") sls::test::misbehave(self->what);
}

int advance(void* plant, const double force_n[3], std::int64_t steps, char* error,
            std::size_t error_size) {
  Plant& self = *static_cast<Plant*>(plant);
  if (self.where == "advance" && self.step >= self.at) {
    sls::test::misbehave(self.what);
    if (self.what == "fail") std::snprintf(error, error_size, "the rope is torn");
    return 1;
  }
  self.step += steps;
  self.held_force_z_n = force_n[2];
  return 0;
}

[[maybe_unused]] void measure(void* plant, sls_plant_state* state) {
  const Plant& self = *static_cast<Plant*>(plant);
  *state = self.state;
  state->signals[0] = static_cast<double>(self.step);
  state->signals[1] = self.held_force_z_n;
  if (self.where != "measure" || self.step < self.at) return;
  sls::test::misbehave(self.what);
  const double nan = std::strtod("nan", nullptr);
  if (self.what == "position that is no number") state->quad_position_m[0] = nan;
  if (self.what == "rate that is no number") state->body_rates_rad_s[2] = nan;
  if (self.what == "signal that is no number") state->signals[1] = nan;
  if (self.what == "attitude of length 2") state->attitude_wb[0] = 2.0;
}

}  // namespace

extern "C" const sls_plant_functions* sls_plant(void) {
  static const char* const names[65] = {TEST_SIGNAL_NAME, "held_force_z_n"};
  static const char* const units[65] = {"1", "N"};
  [[maybe_unused]] static const sls_plant_functions functions = {
      TEST_TABLE_SIZE, TEST_VERSION, TEST_SETUP_SIZE, TEST_STATE_SIZE, TEST_SIGNAL_COUNT, names,
      units,           &create,      &destroy,        &advance,        TEST_MEASURE};
  return TEST_RESULT;
}
