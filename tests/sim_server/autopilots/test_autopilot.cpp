// An autopilot that holds the thrust like `none`. `parameters` can select an error:
//   { do: WHAT, in: create, step or destroy, at: STEP }
// Macros define the invalid tables of functions.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>

#include "sim_server/autopilots/shared_library/sls_autopilot.h"
#include "tests/common/plugin/misbehaviour.hpp"

#ifndef TEST_VERSION
#define TEST_VERSION SLS_AUTOPILOT_VERSION
#endif
#ifndef TEST_TABLE_SIZE
#define TEST_TABLE_SIZE sizeof(sls_autopilot_functions)
#endif
#ifndef TEST_SETUP_SIZE
#define TEST_SETUP_SIZE sizeof(sls_autopilot_setup)
#endif
#ifndef TEST_ROTOR_SIZE
#define TEST_ROTOR_SIZE sizeof(sls_autopilot_rotor)
#endif
#ifndef TEST_INPUT_SIZE
#define TEST_INPUT_SIZE sizeof(sls_autopilot_input)
#endif
#ifndef TEST_OUTPUT_SIZE
#define TEST_OUTPUT_SIZE sizeof(sls_autopilot_output)
#endif
#ifndef TEST_CREATE
#define TEST_CREATE &create
#endif
#ifndef TEST_DESTROY
#define TEST_DESTROY &destroy
#endif
#ifndef TEST_STEP
#define TEST_STEP &step
#endif
#ifndef TEST_RESULT
#define TEST_RESULT &functions
#endif

namespace {

using sls::test::find_parameter;

struct Autopilot {
  std::string what, where;
  std::uint64_t at = 0;
  sls_autopilot_setup setup;
  double filtered = 0.0;  // N
};

/// Writes every number of the setup into `error`, for comparison with the numbers sent.
void say_setup(const sls_autopilot_setup& setup, char* error, std::size_t error_size) {
  const sls_autopilot_rotor& rotor = setup.rotors[3];
  std::snprintf(error, error_size,
                "%s id %u T %g m %g mL %g L %g g %g body %g at %g %g %g "
                "J %g %g %g %g %g %g %g %g %g %u rotors, last at %g %g %g along %g %g %g "
                "spin %g thrust %g torque %g speed %g to %g",
                setup.parameters, setup.vehicle_id, setup.period_s, setup.quad_mass_kg,
                setup.load_mass_kg, setup.rod_length_m, setup.gravity_m_s2, setup.body_mass_kg,
                setup.centre_of_mass_m[0], setup.centre_of_mass_m[1], setup.centre_of_mass_m[2],
                setup.inertia_kg_m2[0][0], setup.inertia_kg_m2[0][1], setup.inertia_kg_m2[0][2],
                setup.inertia_kg_m2[1][0], setup.inertia_kg_m2[1][1], setup.inertia_kg_m2[1][2],
                setup.inertia_kg_m2[2][0], setup.inertia_kg_m2[2][1], setup.inertia_kg_m2[2][2],
                setup.rotor_count, rotor.position_m[0], rotor.position_m[1], rotor.position_m[2],
                rotor.axis[0], rotor.axis[1], rotor.axis[2], rotor.spin, rotor.thrust_constant_n_s2,
                rotor.torque_constant_m, rotor.min_speed_rad_s, rotor.max_speed_rad_s);
}

/// Writes every number of an input.
void say_input(const sls_autopilot_input& input, char* error, std::size_t error_size) {
  std::snprintf(error, error_size, "step %llu t %g F %g %g %g v %g %g %g q %g %g %g %g w %g %g %g",
                static_cast<unsigned long long>(input.step), input.time_s, input.force_n[0],
                input.force_n[1], input.force_n[2], input.velocity_m_s[0], input.velocity_m_s[1],
                input.velocity_m_s[2], input.attitude_wb[0], input.attitude_wb[1],
                input.attitude_wb[2], input.attitude_wb[3], input.body_rates_rad_s[0],
                input.body_rates_rad_s[1], input.body_rates_rad_s[2]);
}

[[maybe_unused]] void* create(const sls_autopilot_setup* setup, char* error,
                              std::size_t error_size) {
  const std::string parameters = setup->parameters;
  auto autopilot = std::make_unique<Autopilot>();
  autopilot->what = find_parameter(parameters, "do");
  autopilot->where = find_parameter(parameters, "in");
  autopilot->at = std::strtoull(find_parameter(parameters, "at").c_str(), nullptr, 10);
  autopilot->setup = *setup;
  if (autopilot->where == "create") {
    sls::test::misbehave(autopilot->what);
    if (autopilot->what == "say the setup") say_setup(*setup, error, error_size);
    return nullptr;
  }
  return autopilot.release();
}

[[maybe_unused]] void destroy(void* autopilot) {
  const std::unique_ptr<Autopilot> self(static_cast<Autopilot*>(autopilot));
  if (self->where == "destroy") sls::test::misbehave(self->what);
}

/// Filters the thrust, which requires a state. The setup must still be accessible.
void fly(Autopilot& self, const sls_autopilot_input& input, sls_autopilot_output* output) {
  const double* f = input.force_n;
  const double wanted = std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
  self.filtered += 0.25 * (wanted - self.filtered);
  for (std::uint32_t i = 0; i < self.setup.rotor_count; ++i)
    output->rotor_speeds_rad_s[i] = std::sqrt(self.filtered / self.setup.rotor_count /
                                              self.setup.rotors[i].thrust_constant_n_s2);
  output->thrust_n = self.filtered;
  for (int i = 0; i < 4; ++i) output->attitude_wb[i] = input.attitude_wb[i];
}

[[maybe_unused]] int step(void* autopilot, const sls_autopilot_input* input,
                          sls_autopilot_output* output, char* error, std::size_t error_size) {
  Autopilot& self = *static_cast<Autopilot*>(autopilot);
  fly(self, *input, output);
  if (self.where != "step" || input->step < self.at) return 0;
  const std::string& what = self.what;
  sls::test::misbehave(what);
  const double nan = std::strtod("nan", nullptr);
  double* speeds = output->rotor_speeds_rad_s;
  if (what == "fail") std::snprintf(error, error_size, "the gyroscope is dead\nand more");
  if (what == "say the input") say_input(*input, error, error_size);
  if (what == "fail" || what == "fail without a word" || what == "say the input") return 1;
  if (what == "three rotors") speeds[3] = nan;  // the initial content of the buffer
  if (what == "five rotors") speeds[4] = 300.0;
  if (what == "speed that is no number") speeds[1] = nan;
  if (what == "speed without end") speeds[2] = HUGE_VAL;
  if (what == "negative speed") speeds[2] = -0.5;
  if (what == "attitude that is no number") output->attitude_wb[2] = nan;
  if (what == "attitude of length 2") {
    output->attitude_wb[0] = 2.0;
    for (int i = 1; i < 4; ++i) output->attitude_wb[i] = 0.0;
  }
  if (what == "thrust that is no number") output->thrust_n = nan;
  if (what == "direction" || what == "direction of length 2" ||
      what == "direction that is no number") {
    output->has_direction = 1;
    output->direction[0] = 0.6;
    output->direction[2] = -0.8;
    if (what == "direction of length 2") output->direction[1] = std::sqrt(3.0);
    if (what == "direction that is no number") output->direction[1] = nan;
  }
  return 0;
}

}  // namespace

extern "C" const sls_autopilot_functions* sls_autopilot(void) {
  [[maybe_unused]] static const sls_autopilot_functions functions = {
      TEST_TABLE_SIZE,  TEST_VERSION, TEST_SETUP_SIZE, TEST_ROTOR_SIZE, TEST_INPUT_SIZE,
      TEST_OUTPUT_SIZE, TEST_CREATE,  TEST_DESTROY,    TEST_STEP};
  return TEST_RESULT;
}
