/* Your own autopilot: a proportional-derivative law on the attitude's quaternion, and the
 * shares of four rotors in an X. The equations are in README.md. */
#define _GNU_SOURCE /* strtod_l */
#include <locale.h>
#include <math.h>
#include <sls/sls_autopilot.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { kAttitude, kRate, kParameters };
static const char* const kNames[] = {"attitude_1_s2", "rate_1_s"};

enum { kThrust, kRoll, kPitch, kYaw, kWishes }; /* N, and moments about the centre of mass, N m */
enum { kRotors = 4 };

typedef struct {
  double k[kParameters];
  sls_autopilot_setup setup;
  double share[kRotors][kWishes]; /* of each rotor's thrust in each wish */
} Autopilot;

/* Reads {"attitude_1_s2": 900, …} into `k`. Returns 0 and writes `error` if it cannot. */
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
      snprintf(error, error_size, "expected attitude_1_s2 or rate_1_s, got %.*s", length, name);
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

/* Eq. (4). Returns 0 if the rotors are not an X about the centre of mass, because a change of one
 * wish would then change another. */
static int find_shares(Autopilot* self) {
  double effect[kRotors][kWishes]; /* of 1 N of each rotor */
  if (self->setup.rotor_count != kRotors) return 0;
  for (int i = 0; i < kRotors; ++i) {
    const sls_autopilot_rotor* rotor = &self->setup.rotors[i];
    if (rotor->axis[2] != -1.0) return 0;
    effect[i][kThrust] = 1.0;
    effect[i][kRoll] = self->setup.centre_of_mass_m[1] - rotor->position_m[1];
    effect[i][kPitch] = rotor->position_m[0] - self->setup.centre_of_mass_m[0];
    effect[i][kYaw] = rotor->spin * rotor->torque_constant_m;
  }
  for (int j = 0; j < kWishes; ++j)
    for (int l = 0; l < kWishes; ++l) {
      double sum = 0.0;
      for (int i = 0; i < kRotors; ++i) sum += effect[i][j] * effect[i][l];
      if ((j == l) != (sum * sum > 1e-18)) return 0;
      if (j == l)
        for (int i = 0; i < kRotors; ++i) self->share[i][j] = effect[i][j] / sum;
    }
  return 1;
}

static void* create(const sls_autopilot_setup* setup, char* error, size_t error_size) {
  Autopilot made = {{900.0, 50.0}, *setup, {{0}}};
  if (!read_parameters(setup->parameters, made.k, error, error_size)) return NULL;
  if (!find_shares(&made)) {
    snprintf(error, error_size, "expected four rotors in an X about the centre of mass");
    return NULL;
  }
  return memcpy(malloc(sizeof made), &made, sizeof made);
}

/* Eq. (1): the attitude without yaw in which the rotors pull along `force`. */
static void find_attitude(const double force[3], double length, double q[4]) {
  const double roll = asin(force[1] / length), pitch = atan2(-force[0], -force[2]);
  q[0] = cos(pitch / 2) * cos(roll / 2);
  q[1] = cos(pitch / 2) * sin(roll / 2);
  q[2] = sin(pitch / 2) * cos(roll / 2);
  q[3] = -sin(pitch / 2) * sin(roll / 2);
}

/* Eq. (2): twice the vector part of wanted* q, for the shorter of the two rotations. */
static void calc_attitude_error(const double wanted[4], const double q[4], double error[3]) {
  const double *a = wanted, *b = q;
  const double w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  const double twice = w < 0.0 ? -2.0 : 2.0;
  error[0] = twice * (a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2]);
  error[1] = twice * (a[0] * b[2] - a[2] * b[0] - a[3] * b[1] + a[1] * b[3]);
  error[2] = twice * (a[0] * b[3] - a[3] * b[0] - a[1] * b[2] + a[2] * b[1]);
}

/* Eq. (3). */
static void calc_moment(const Autopilot* self, const double error[3], const double w[3],
                        double moment[3]) {
  double spin[3];
  for (int i = 0; i < 3; ++i) {
    const double* J = self->setup.inertia_kg_m2[i];
    moment[i] = spin[i] = 0.0;
    for (int j = 0; j < 3; ++j) {
      moment[i] -= J[j] * (self->k[kAttitude] * error[j] + self->k[kRate] * w[j]);
      spin[i] += J[j] * w[j];
    }
  }
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    moment[i] += w[j] * spin[k] - w[k] * spin[j];
  }
}

static int step(void* autopilot, const sls_autopilot_input* input, sls_autopilot_output* output,
                char* error, size_t error_size) {
  const Autopilot* self = autopilot;
  const double *f = input->force_n, *q = input->attitude_wb;
  const double length = sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
  if (length > 0.0) find_attitude(f, length, output->attitude_wb); /* else level, as at first */

  /* Direction of the rotors' thrust: minus the z axis of the body, in the world. */
  const double up[3] = {-2 * (q[1] * q[3] + q[0] * q[2]), -2 * (q[2] * q[3] - q[0] * q[1]),
                        2 * (q[1] * q[1] + q[2] * q[2]) - 1};
  double wish[kWishes], attitude_error[3];
  wish[kThrust] = fmax(0.0, f[0] * up[0] + f[1] * up[1] + f[2] * up[2]);
  calc_attitude_error(output->attitude_wb, q, attitude_error);
  calc_moment(self, attitude_error, input->body_rates_rad_s, wish + kRoll);
  output->thrust_n = wish[kThrust];

  for (int i = 0; i < kRotors; ++i) {
    double thrust = 0.0;
    for (int j = 0; j < kWishes; ++j) thrust += self->share[i][j] * wish[j];
    output->rotor_speeds_rad_s[i] =
        sqrt(fmax(0.0, thrust) / self->setup.rotors[i].thrust_constant_n_s2);
  }
  (void)error, (void)error_size; /* this step never fails */
  return 0;
}

const sls_autopilot_functions* sls_autopilot(void) {
  static const sls_autopilot_functions functions = {
      .size = sizeof functions,
      .version = SLS_AUTOPILOT_VERSION,
      .setup_size = sizeof(sls_autopilot_setup),
      .rotor_size = sizeof(sls_autopilot_rotor),
      .input_size = sizeof(sls_autopilot_input),
      .output_size = sizeof(sls_autopilot_output),
      .create = &create,
      .destroy = &free,
      .step = &step,
  };
  return &functions;
}
