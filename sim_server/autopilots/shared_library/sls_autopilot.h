/* An autopilot of your own for SLS, in C11 or any language that exports C functions (MATLAB Coder,
 * Simulink, …).
 *
 * Build a shared library that defines sls_autopilot() and name it in a scenario:
 *
 *     autopilot: { model: ./my_autopilot.so, period_s: 0.004, parameters: { roll: 6.5 } }
 *
 * The body frame B and the world frame W have x forward, y right, z down. SI units, radians. Paths
 * are relative to the scenario file. There is one autopilot per vehicle. Calls of different
 * autopilots come on different threads; calls of one autopilot never overlap. Its output must
 * depend only on the setup and the sequence of its inputs. Do not change the floating-point mode
 * (link without -ffast-math), the locale, the working folder or the umask. */
#ifndef SLS_AUTOPILOT_H
#define SLS_AUTOPILOT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SLS_AUTOPILOT_VERSION 1

/* A rotor. At the speed w (rad/s) its thrust is thrust_constant_n_s2 * w * w along its axis. The
 * torque of its drag on the body is -spin * torque_constant_m * thrust about that axis. */
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
  /* The rigid body of the vehicle with everything fixed to it, without the pendulum. */
  double body_mass_kg;
  double centre_of_mass_m[3]; /* from the body's origin, in B */
  double inertia_kg_m2[3][3]; /* about the centre of mass, in B */
  uint32_t rotor_count;       /* at least one */
  const sls_autopilot_rotor* rotors;
} sls_autopilot_setup;

/* Input of an autopilot's step. W is the world frame of the estimator. The scenario may turn it
 * against the true frame (`estimator`). */
typedef struct {
  size_t size; /* of this struct */
  uint64_t step; /* number of earlier steps */
  double time_s; /* since the first step */
  double force_n[3];          /* command of the controller, on the body, in W */
  double velocity_m_s[3];     /* of the body's origin, in W */
  double attitude_wb[4];      /* unit quaternion w, x, y, z: rotates body vectors into the world */
  double body_rates_rad_s[3]; /* in B */
} sls_autopilot_input;

/* Output of an autopilot, valid until its next step. */
typedef struct {
  size_t size; /* of this struct */
  /* Set-points of the rotors, rad/s, >= 0: an array of `rotor_count` numbers, all NaN before the
   * call. Write all of them. The plant clamps each to its rotor's smallest and largest speed. */
  double* rotor_speeds_rad_s;
  double attitude_wb[4]; /* set-point, for the record; unit quaternion, begins as (1, 0, 0, 0) */
  double thrust_n; /* commanded collective thrust along the axes, for the record; begins as 0 */
  /* Begins as 0. If it is not 0, the thrust of all rotors acts at the centre of mass along
   * `direction`, a unit vector in W, and no rotor turns the body. For an autopilot that replaces a
   * whole attitude loop. */
  int has_direction;
  double direction[3];
} sls_autopilot_output;

typedef struct {
  size_t size;      /* sizeof(sls_autopilot_functions) */
  uint32_t version; /* SLS_AUTOPILOT_VERSION */
  /* sizeof of the structs above, as you compiled them */
  size_t setup_size, rotor_size, input_size, output_size;

  /* Returns a new autopilot. If it refuses the setup, it returns NULL and writes a text of at most
   * `error_size` bytes to `error`: the parameter, the expected value, the value it got. */
  void* (*create)(const sls_autopilot_setup* setup, char* error, size_t error_size);
  void (*destroy)(void* autopilot);
  /* One period. Returns 0, or 1 with a text in `error`: then the run ends. */
  int (*step)(void* autopilot, const sls_autopilot_input* input, sls_autopilot_output* output,
              char* error, size_t error_size);
} sls_autopilot_functions;

/* The one symbol that a library defines. Its result must live as long as the library. */
const sls_autopilot_functions* sls_autopilot(void);

#ifdef __cplusplus
}
#endif

#endif
