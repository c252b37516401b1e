/* Your own plant: quadrotor and load are two point masses, joined by an elastic rope instead of a
 * rod. It publishes one signal, the stretch of the rope. */
#define _GNU_SOURCE /* strtod_l */
#include <locale.h>
#include <math.h>
#include <sls/sls_plant.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { kStiffness, kDamping, kParameters };
static const char* const kNames[] = {"stiffness_n_per_m", "damping_n_s_m"};

/* Positions (m) and velocities (m/s) of quadrotor and load, in the world frame. */
typedef struct {
  double p_quad[3], p_load[3], v_quad[3], v_load[3];
} Motion;
enum { kNumbers = sizeof(Motion) / sizeof(double) };

typedef struct {
  double k[kParameters];
  sls_plant_setup setup;
  Motion motion;
} Plant;

/* Reads {"stiffness_n_per_m": 2000, …} into `k`. Returns 0 and writes `error` if it cannot. */
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
      snprintf(error, error_size, "expected stiffness_n_per_m or damping_n_s_m, got %.*s", length,
               name);
      return 0;
    }
    k[i] = strtod_l(value, &end, c);
    if (end == value || !(k[i] > 0.0)) {
      snprintf(error, error_size, "%s: expected a number > 0, got %.*s", kNames[i],
               (int)strcspn(value, ",}"), value);
      return 0;
    }
  }
  return 1;
}

static void* create(const sls_plant_setup* setup, char* error, size_t error_size) {
  const sls_plant_state* initial = &setup->initial;
  Plant made = {{2000.0, 2.0}, *setup, {{0}, {0}, {0}, {0}}};
  if (!read_parameters(setup->parameters, made.k, error, error_size)) return NULL;
  memcpy(made.motion.p_quad, initial->quad_position_m, sizeof made.motion.p_quad);
  memcpy(made.motion.p_load, initial->load_position_m, sizeof made.motion.p_load);
  memcpy(made.motion.v_quad, initial->quad_velocity_m_s, sizeof made.motion.v_quad);
  memcpy(made.motion.v_load, initial->load_velocity_m_s, sizeof made.motion.v_load);
  return memcpy(malloc(sizeof made), &made, sizeof made);
}

static double calc_stretch(const Plant* self, const Motion* now, double n[3], double* speed) {
  double length = 0.0;
  for (int i = 0; i < 3; ++i) {
    n[i] = now->p_load[i] - now->p_quad[i];
    length += n[i] * n[i];
  }
  length = sqrt(length);
  *speed = 0.0;
  for (int i = 0; i < 3; ++i) {
    n[i] /= length;
    *speed += n[i] * (now->v_load[i] - now->v_quad[i]);
  }
  return length - self->setup.rod_length_m;
}

/* m a = m g + F + T n and m_L a_L = m_L g - T n, with T = k stretch + c d(stretch)/dt. */
static Motion calc_rate(const Plant* self, const Motion* now, const double force_n[3]) {
  Motion rate;
  double n[3], speed;
  const double stretch = calc_stretch(self, now, n, &speed);
  const double tension = self->k[kStiffness] * stretch + self->k[kDamping] * speed;
  for (int i = 0; i < 3; ++i) {
    const double gravity = i == 2 ? self->setup.gravity_m_s2 : 0.0;
    rate.p_quad[i] = now->v_quad[i];
    rate.p_load[i] = now->v_load[i];
    rate.v_quad[i] = gravity + (force_n[i] + tension * n[i]) / self->setup.quad_mass_kg;
    rate.v_load[i] = gravity - tension * n[i] / self->setup.load_mass_kg;
  }
  return rate;
}

/* start + h * rate, number by number. */
static Motion add(Motion start, double h, Motion rate) {
  double sum[kNumbers], by[kNumbers];
  memcpy(sum, &start, sizeof sum);
  memcpy(by, &rate, sizeof by);
  for (int i = 0; i < kNumbers; ++i) sum[i] += h * by[i];
  memcpy(&start, sum, sizeof sum);
  return start;
}

/* One step of the fixed size by a Runge-Kutta method of fourth order. */
static Motion calc_next(const Plant* self, Motion start, const double force_n[3]) {
  const double h = self->setup.step_s;
  const Motion k1 = calc_rate(self, &start, force_n);
  const Motion at2 = add(start, h / 2, k1), k2 = calc_rate(self, &at2, force_n);
  const Motion at3 = add(start, h / 2, k2), k3 = calc_rate(self, &at3, force_n);
  const Motion at4 = add(start, h, k3), k4 = calc_rate(self, &at4, force_n);
  return add(add(add(add(start, h / 6, k1), h / 3, k2), h / 3, k3), h / 6, k4);
}

static int advance(void* plant, const double force_n[3], int64_t steps, char* error,
                   size_t error_size) {
  Plant* self = plant;
  Motion motion = self->motion; /* a copy: a failed call does not change the plant */
  for (int64_t i = 0; i < steps; ++i) {
    double n[3], speed;
    motion = calc_next(self, motion, force_n);
    if (calc_stretch(self, &motion, n, &speed) > 0.1 * self->setup.rod_length_m) {
      snprintf(error, error_size, "the rope is torn: stretched by more than a tenth");
      return 1;
    }
  }
  self->motion = motion;
  return 0;
}

static void measure(void* plant, sls_plant_state* state) {
  const Plant* self = plant;
  double n[3], speed;
  memcpy(state->quad_position_m, self->motion.p_quad, sizeof state->quad_position_m);
  memcpy(state->quad_velocity_m_s, self->motion.v_quad, sizeof state->quad_velocity_m_s);
  memcpy(state->load_position_m, self->motion.p_load, sizeof state->load_position_m);
  memcpy(state->load_velocity_m_s, self->motion.v_load, sizeof state->load_velocity_m_s);
  state->attitude_wb[0] = 1.0; /* level: this plant has no attitude */
  state->signals[0] = calc_stretch(self, &self->motion, n, &speed);
}

const sls_plant_functions* sls_plant(void) {
  static const char* const names[] = {"rope_stretch_m"};
  static const char* const units[] = {"m"};
  static const sls_plant_functions functions = {
      .size = sizeof functions,
      .version = SLS_PLANT_VERSION,
      .setup_size = sizeof(sls_plant_setup),
      .state_size = sizeof(sls_plant_state),
      .signal_count = 1,
      .signal_names = names,
      .signal_units = units,
      .create = &create,
      .destroy = &free,
      .advance = &advance,
      .measure = &measure,
  };
  return &functions;
}
