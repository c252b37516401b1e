/* Your own control law for SLS, in C11 or any language that exports C functions (MATLAB Coder,
 * Simulink, CasADi, …).
 *
 * Build a shared library that defines sls_controller() and name it in a scenario:
 *
 *     controller: { law: ./my_controller.so, parameters: { gain: 2.5 } }
 *
 * Frame: x forward, y right, z down. SI units, radians. Paths are relative to the scenario file.
 * There is one controller per vehicle. Different controllers can be called on different threads at
 * the same time, but each one has only one call at a time. An answer must be a function of the
 * input alone. The state of the law (integrals, filter states) belongs in the memory numbers: they
 * travel with the samples, so another client can take over. Do not change the floating-point mode
 * (link without -ffast-math), the locale, the working folder or the umask. */
#ifndef SLS_CONTROLLER_H
#define SLS_CONTROLLER_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SLS_CONTROLLER_VERSION 1
#define SLS_CONTROLLER_MAX_MEMORY 64

/* The setup of a controller. Its pointers are valid until `create` returns. */
typedef struct {
  size_t size;            /* of this struct */
  const char* parameters; /* `controller.parameters` as JSON, a map; "{}" where there is none */
  uint32_t vehicle_id;
  double period_s; /* control period in force */
  /* The vehicle parameters that the controller uses (`controller.model`). */
  double quad_mass_kg, load_mass_kg, rod_length_m, gravity_m_s2;
  double force_limit_n; /* the server refuses a stronger force */
} sls_controller_setup;

/* The measured state, the reference and the memory of one step. Vectors are in the world frame,
 * except where another frame is given. */
typedef struct {
  size_t size; /* of this struct */
  uint64_t step;
  double time_s; /* since step 0 */

  double quad_position_m[3], quad_velocity_m_s[3];
  double attitude_wb[4];         /* unit quaternion w, x, y, z: rotates body vectors into the world */
  double body_rates_rad_s[3];    /* in the body frame; a point mass is level, with zero rates */
  double load_position_m[3], load_velocity_m_s[3];
  double alpha_rad, beta_rad;    /* rod angles about x and y; 0: load below */
  double alpha_dot_rad_s, beta_dot_rad_s;
  uint32_t signal_count;         /* of the plant */
  const double* signals;

  uint32_t stage;                /* of the mission */
  double stage_time_s;           /* since that stage began */
  double reference_position_m[3], reference_velocity_m_s[3], reference_acceleration_m_s2[3];
  double reference_jerk_m_s3[3], reference_snap_m_s4[3];

  const double* memory;          /* as returned for the previous step; zeros at step 0 */
} sls_controller_input;

/* The answer. */
typedef struct {
  size_t size; /* of this struct */
  double force_n[3]; /* on the quadrotor */
  double* memory;    /* for the next step: as many numbers as `create` requested, set to zero */
} sls_controller_output;

/* The result of `answer`. A fault fails the mission; the force is then not used. */
enum {
  SLS_CONTROLLER_OK = 0,
  SLS_CONTROLLER_FREE_FALL = 1,
  SLS_CONTROLLER_ROD_LEVEL = 2,
  SLS_CONTROLLER_NOT_FINITE = 3,
  SLS_CONTROLLER_ERROR = 4 /* the client ends with the text in `error` */
};

typedef struct {
  size_t size;      /* sizeof(sls_controller_functions) */
  uint32_t version; /* SLS_CONTROLLER_VERSION */
  size_t setup_size, input_size, output_size; /* sizeof of the structs above, as you compiled them */

  /* Makes a controller and sets `memory_count` to the number of its memory numbers. To refuse, it
   * returns NULL and writes a text into `error` (`error_size` bytes) with the parameter, the
   * expectation and the value. */
  void* (*create)(const sls_controller_setup* setup, uint32_t* memory_count, char* error,
                  size_t error_size);
  void (*destroy)(void* controller);
  int (*answer)(void* controller, const sls_controller_input* input, sls_controller_output* output,
                char* error, size_t error_size);
} sls_controller_functions;

/* The only symbol that a library must define. Its result must be valid as long as the library is
 * loaded. */
const sls_controller_functions* sls_controller(void);

#ifdef __cplusplus
}
#endif

#endif
