/* Your own controller, a cascade: the position error gives a desired velocity, its error a desired
 * acceleration, and that a desired slope of the rod. Its memory travels as numbers: see README.md.
 */
#define _GNU_SOURCE /* strtod_l */
#include <locale.h>
#include <sls/sls_controller.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { kPosition, kVelocity, kIntegral, kRodAngle, kRodRate, kFilter, kParameters };
static const char* const kNames[] = {"position",  "velocity", "integral",
                                     "rod_angle", "rod_rate", "filter_s"};

/* The memory numbers: integral of the height error (m s), filtered rate of the rod's slope (1/s).
 */
enum { kHeightIntegral, kSlopeRateX, kSlopeRateY, kMemoryNumbers };

typedef struct {
  double k[kParameters];
  sls_controller_setup setup;
} Controller;

/* Reads {"velocity": 2.5, …} into `k`. Returns 0 and writes `error` if it cannot. */
static int read_parameters(const char* json, double* k, char* error, size_t error_size) {
  char* end;
  locale_t c = newlocale(LC_ALL_MASK, "C", NULL); /* the process may have a decimal comma */
  for (const char* at = strchr(json, '"'); at; at = strchr(end, '"')) {
    const char* name = at + 1;
    const int length = (int)strcspn(name, "\"");
    const char* value = name + length + 1 + strspn(name + length + 1, ": ");
    int i = 0;
    while (i < kParameters && (strncmp(kNames[i], name, (size_t)length) || kNames[i][length])) ++i;
    if (i == kParameters) {
      snprintf(error, error_size,
               "expected position, velocity, integral, rod_angle, rod_rate or filter_s, got %.*s",
               length, name);
      return 0;
    }
    k[i] = strtod_l(value, &end, c);
    if (end == value || !(k[i] >= 0.0)) {
      snprintf(error, error_size, "%s: expected a number >= 0, got %.*s", kNames[i],
               (int)strcspn(value, ",}"), value);
      return 0;
    }
  }
  return 1;
}

static void* create(const sls_controller_setup* setup, uint32_t* memory_count, char* error,
                    size_t error_size) {
  Controller made = {{0.8, 1.5, 0.5, 36.0, 12.0, 0.02}, *setup};
  if (!read_parameters(setup->parameters, made.k, error, error_size)) return NULL;
  *memory_count = kMemoryNumbers;
  return memcpy(malloc(sizeof made), &made, sizeof made);
}

static int answer(void* controller, const sls_controller_input* input,
                  sls_controller_output* output, char* error, size_t error_size) {
  const Controller* self = controller;
  const double *k = self->k, *desired = input->reference_position_m;
  const double period = self->setup.period_s, gravity = self->setup.gravity_m_s2;
  const double quad_mass = self->setup.quad_mass_kg, mass = quad_mass + self->setup.load_mass_kg;
  const double dz = input->load_position_m[2] - input->quad_position_m[2]; /* z is down */
  const double vz = input->load_velocity_m_s[2] - input->quad_velocity_m_s[2];
  if (dz < 1e-3 * self->setup.rod_length_m) return SLS_CONTROLLER_ROD_LEVEL;
  const double height_error = desired[2] - input->load_position_m[2];
  const double down = k[kVelocity] * (k[kPosition] * height_error - input->load_velocity_m_s[2]) +
                      k[kIntegral] * input->memory[kHeightIntegral];
  const double support = gravity - down;
  if (support < 1e-3 * gravity) return SLS_CONTROLLER_FREE_FALL;
  output->force_n[2] = -mass * support;
  output->memory[kHeightIntegral] = input->memory[kHeightIntegral] + period * height_error;

  for (int i = 0; i < 2; ++i) {
    const double velocity = k[kPosition] * (desired[i] - input->load_position_m[i]);
    const double wanted = k[kVelocity] * (velocity - input->load_velocity_m_s[i]);
    const double slope = (input->load_position_m[i] - input->quad_position_m[i]) / dz;
    const double slope_rate =
        (input->load_velocity_m_s[i] - input->quad_velocity_m_s[i] - slope * vz) / dz;
    const double old = input->memory[kSlopeRateX + i];
    const double filtered = old + period / (period + k[kFilter]) * (slope_rate - old);
    const double turn = k[kRodAngle] * (-wanted / support - slope) - k[kRodRate] * filtered;
    output->force_n[i] = -mass * support * slope - quad_mass * self->setup.rod_length_m * turn;
    output->memory[kSlopeRateX + i] = filtered;
  }
  (void)error, (void)error_size; /* only for SLS_CONTROLLER_ERROR */
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
