/* A plant of your own for SLS, in C11 or in a language that exports C functions.
 *
 * Build a shared library that defines sls_plant() and name it in a scenario:
 *
 *     plant: { model: ./my_plant.so, parameters: { drag: 0.1 }, step_s: 0.001, initial: { … } }
 *
 * Frame: x forward, y right, z down. SI units, radians. Paths are relative to the scenario file.
 * There is one plant per vehicle. Calls of different plants come on different threads; calls of one
 * plant never overlap. A flight must depend only on the setup and the sequence of forces, not on
 * how the steps are split into calls of `advance`. Do not change the floating-point mode
 * (link without -ffast-math), the locale, the working folder or the umask. */
#ifndef SLS_PLANT_H
#define SLS_PLANT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SLS_PLANT_VERSION 1
#define SLS_PLANT_MAX_SIGNALS 64

/* State and signals of a vehicle. Vectors are in the world frame unless said otherwise. */
typedef struct {
  size_t size; /* of this struct */
  double quad_position_m[3], quad_velocity_m_s[3];
  double load_position_m[3], load_velocity_m_s[3];
  double attitude_wb[4];      /* unit quaternion w, x, y, z: rotates body vectors into the world */
  double body_rates_rad_s[3]; /* in the body frame */
  double signals[SLS_PLANT_MAX_SIGNALS];
} sls_plant_state;

/* The setup of a plant. Its pointers are valid until `create` returns. */
typedef struct {
  size_t size;            /* of this struct */
  const char* parameters; /* `plant.parameters` as JSON, a map; "{}" where there is none */
  uint32_t vehicle_id;
  double step_s; /* the fixed step of integration */
  double quad_mass_kg, load_mass_kg, rod_length_m, gravity_m_s2; /* `vehicle` */
  sls_plant_state initial; /* `plant.initial`, the bodies a rod's length apart, level; no signals */
} sls_plant_setup;

typedef struct {
  size_t size;      /* sizeof(sls_plant_functions) */
  uint32_t version; /* SLS_PLANT_VERSION */
  size_t setup_size, state_size; /* sizeof of the structs above, as you compiled them */

  uint32_t signal_count; /* signals that the plant publishes */
  const char* const* signal_names; /* columns of state.csv: lower-case letters, digits and '_' */
  const char* const* signal_units;

  /* Returns a new plant. If it refuses the setup, it returns NULL and writes a text of at most
   * `error_size` bytes to `error`: the parameter, the expected value, the value it got. */
  void* (*create)(const sls_plant_setup* setup, char* error, size_t error_size);
  void (*destroy)(void* plant);
  /* Advances `steps` steps with the control force on the quadrotor held. Returns 0, or 1 with a
   * text in `error`: then the run ends. */
  int (*advance)(void* plant, const double force_n[3], int64_t steps, char* error,
                 size_t error_size);
  /* Writes the current state of the plant to `state`. */
  void (*measure)(void* plant, sls_plant_state* state);
} sls_plant_functions;

/* The one symbol that a library defines. Its result must live as long as the library. */
const sls_plant_functions* sls_plant(void);

#ifdef __cplusplus
}
#endif

#endif
