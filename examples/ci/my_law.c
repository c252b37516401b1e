/* The law under test: the slope of the rod accelerates the load towards the reference.
 * ../my_controller explains the interface. */
#include <sls/sls_controller.h>
#include <stdlib.h>
#include <string.h>

static void* create(const sls_controller_setup* setup, uint32_t* memory_count, char* error,
                    size_t error_size) {
  return memcpy(malloc(sizeof *setup), setup, sizeof *setup);
}

static int answer(void* controller, const sls_controller_input* now, sls_controller_output* output,
                  char* error, size_t error_size) {
  const sls_controller_setup* setup = controller;
  const double mass = setup->quad_mass_kg + setup->load_mass_kg;
  const double dz = now->load_position_m[2] - now->quad_position_m[2]; /* z is down */
  double wanted[3]; /* acceleration of the load */
  if (dz < 0.1 * setup->rod_length_m) return SLS_CONTROLLER_ROD_LEVEL;
  for (int i = 0; i < 3; ++i)
    wanted[i] = 1.5 * (0.8 * (now->reference_position_m[i] - now->load_position_m[i]) -
                       now->load_velocity_m_s[i]);
  const double support = setup->gravity_m_s2 - wanted[2];
  for (int i = 0; i < 2; ++i) {
    const double slope = (now->load_position_m[i] - now->quad_position_m[i]) / dz;
    const double slope_rate = (now->load_velocity_m_s[i] - now->quad_velocity_m_s[i]) / dz;
    const double turn = 36.0 * (-wanted[i] / support - slope) - 12.0 * slope_rate;
    output->force_n[i] = -mass * support * slope - setup->quad_mass_kg * setup->rod_length_m * turn;
  }
  output->force_n[2] = -mass * support;
  return SLS_CONTROLLER_OK;
}

const sls_controller_functions* sls_controller(void) {
  static const sls_controller_functions functions = {sizeof functions,
                                                     SLS_CONTROLLER_VERSION,
                                                     sizeof(sls_controller_setup),
                                                     sizeof(sls_controller_input),
                                                     sizeof(sls_controller_output),
                                                     &create,
                                                     &free,
                                                     &answer};
  return &functions;
}
