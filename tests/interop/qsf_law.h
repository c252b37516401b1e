/// The QSF law for set-points: a second implementation of design section 4, in C. It calculates the
/// rod's direction from positions instead of angles, and its acceleration by projection.
#pragma once

#include <stdbool.h>

typedef struct Vehicle {
  double quad_mass;   ///< kg
  double load_mass;   ///< kg
  double rod_length;  ///< m
  double gravity;     ///< m/s²
} Vehicle;

/// Each gain has the name of the quantity that it multiplies.
typedef struct Gains {
  double position, velocity, acceleration, jerk;
} Gains;

/// Positions (m) and velocities (m/s) of quadrotor and load in W.
typedef struct Motion {
  double p_WQ[3], v_WQ[3], p_WL[3], v_WL[3];
} Motion;

/// LQR gains of a chain of four integrators, all states weighted with `weight` > 0, R = 1.
Gains calc_horizontal_gains(double weight);
/// The same for a chain of two integrators: position and velocity.
Gains calc_vertical_gains(double weight);

typedef enum LawFault { kNoFault, kFreeFall, kRodLevel, kNotFinite } LawFault;

/// Force on the quadrotor (N) that brings the load to `set_point` (m) and keeps it there; zero if a
/// fault is returned.
LawFault calc_force(const Motion* motion, const double set_point[3], const Vehicle* vehicle,
                    const Gains* horizontal, const Gains* vertical, double f_Q_W[3]);
