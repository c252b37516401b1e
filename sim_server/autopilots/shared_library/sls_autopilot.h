/* An autopilot of your own for SLS, in C11 or any language that exports C functions (MATLAB Coder,
 * Simulink, …).
 *
 * Build a shared library that defines sls_autopilot() and name it in a scenario:
 *
 *     autopilot: { model: ./my_autopilot.so, period_s: 0.004, parameters: { roll: 6.5 } }
 *
 * The body frame B and the world frame W have x forward, y right, z down. SI units, radians. Paths are
 * relative to the scenario file. There is one autopilot per vehicle; different ones are called on
 * different threads, each by one call at a time. Its output must be a function of the setup
 * and the sequence of its inputs alone. Do not change the floating-point mode: link without
 * -ffast-math. */
#ifndef SLS_AUTOPILOT_H
#define SLS_AUTOPILOT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SLS_AUTOPILOT_VERSION 1

/* A rotor. Turning at w (rad/s) it pulls with thrust_constant_n_s2 * w * w along its axis, and its
 * drag turns the body with -spin * torque_constant_m * thrust about that axis. */
typedef struct {
  size_t size;          /* of this struct */
  double position_m[3]; /* of the hub, from the body's origin, in B */
  double axis[3];       /* unit vector along the thrust, in B; (0, 0, -1) pulls up */
  double spin;          /* 1: turns counter-clockwise seen from above; -1: clockwise */
  double thrust_constant_n_s2;
  double torque_constant_m;
  double min_speed_rad_s, max_speed_rad_s;
} sls_autopilot_rotor;

/* The setup of an autopilot. Its pointers are valid as long as the autopilot. */
typedef struct {
  size_t size;            /* of this struct */
  const char* parameters; /* `autopilot.parameters` as JSON, a map; "{}" where there is none */
  uint32_t vehicle_id;
  double period_s; /* from one step to the next */
  double quad_mass_kg, load_mass_kg, rod_length_m, gravity_m_s2; /* `vehicle` */
  /* The body that is flown, with all that is fixed to it; without the pendulum. */
  double body_mass_kg;
  double centre_of_mass_m[3]; /* from the body's origin, in B */
  double inertia_kg_m2[3][3]; /* about the centre of mass, in B */
  uint32_t rotor_count;       /* at least one */
  const sls_autopilot_rotor* rotors;
} sls_autopilot_setup;

/* Input of an autopilot's step. Its W is the world as its estimator has it: the scenario may turn
 * that against the true one (`estimator`). */
typedef struct {
  size_t size; /* of this struct */
  uint64_t step; /* how many there were before */
  double time_s; /* since the first */
  double force_n[3];          /* that the controller asks for, on the body, in W */
  double velocity_m_s[3];     /* of the body's origin, in W */
  double attitude_wb[4];      /* unit quaternion w, x, y, z: rotates body vectors into the world */
  double body_rates_rad_s[3]; /* in B */
} sls_autopilot_input;

/* Its output until its next step. */
typedef struct {
  size_t size; /* of this struct */
  /* Set-points of the rotors, rad/s, >= 0. Room for `rotor_count` numbers, which begin as NaN: write
   * them all. The plant keeps each between its rotor's smallest and largest speed. */
  double* rotor_speeds_rad_s;
  double attitude_wb[4]; /* set-point, for the record; unit quaternion, begins as (1, 0, 0, 0) */
  double thrust_n; /* collective thrust that is asked for along the axes, for the record; begins as 0 */
  /* Other than 0, which it begins as: the thrust of all rotors acts at the centre of mass along
   * `direction`, a unit vector in W, and no rotor turns the body. For an autopilot that stands for a
   * whole attitude loop. */
  int has_direction;
  double direction[3];
} sls_autopilot_output;

typedef struct {
  size_t size;      /* sizeof(sls_autopilot_functions) */
  uint32_t version; /* SLS_AUTOPILOT_VERSION */
  /* sizeof of the structs above, as you compiled them */
  size_t setup_size, rotor_size, input_size, output_size;

  /* Makes an autopilot. NULL with a text in `error`, which has room for `error_size` bytes, where it
   * refuses: say which parameter, expected and got. */
  void* (*create)(const sls_autopilot_setup* setup, char* error, size_t error_size);
  void (*destroy)(void* autopilot);
  /* One period. 0, or 1 with a text in `error`, which ends the run. */
  int (*step)(void* autopilot, const sls_autopilot_input* input, sls_autopilot_output* output,
              char* error, size_t error_size);
} sls_autopilot_functions;

/* The one symbol that a library defines. Its result must live as long as the library. */
const sls_autopilot_functions* sls_autopilot(void);

#ifdef __cplusplus
}
#endif

#endif
