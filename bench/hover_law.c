/* A minimal controller, to measure the cost of a call: its force only carries the weight. */
#include <stdlib.h>

#include "control_client/laws/shared_library/sls_controller.h"

static void* create(const sls_controller_setup* setup, uint32_t* memory_count, char* error,
                    size_t error_size) {
  (void)error, (void)error_size;
  double* weight_n = malloc(sizeof *weight_n);
  if (weight_n) *weight_n = (setup->quad_mass_kg + setup->load_mass_kg) * setup->gravity_m_s2;
  *memory_count = 3;
  return weight_n;
}

static int answer(void* controller, const sls_controller_input* input,
                  sls_controller_output* output, char* error, size_t error_size) {
  (void)error, (void)error_size;
  output->force_n[2] = -*(const double*)controller;
  for (int i = 0; i < 3; ++i) output->memory[i] = input->memory[i];
  return SLS_CONTROLLER_OK;
}

const sls_controller_functions* sls_controller(void) {
  static const sls_controller_functions functions = {
      .size = sizeof functions,
      .version = SLS_CONTROLLER_VERSION,
      .setup_size = sizeof(sls_controller_setup),
      .input_size = sizeof(sls_controller_input),
      .output_size = sizeof(sls_controller_output),
      .create = &create,
      .destroy = &free,
      .answer = &answer,
  };
  return &functions;
}
