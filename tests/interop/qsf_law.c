#include "qsf_law.h"

#include <math.h>
#include <string.h>

enum { kX, kY, kZ };

static const double kMinRodCosine = 1e-3;        // of n_z: level is 0
static const double kMinSupportFraction = 1e-3;  // of gravity; below it the load falls freely

static double dot(const double a[3], const double b[3]) {
  return a[kX] * b[kX] + a[kY] * b[kY] + a[kZ] * b[kZ];
}

Gains calc_vertical_gains(double weight) {
  const double position = sqrt(weight);
  return (Gains){.position = position, .velocity = sqrt(weight + 2.0 * position)};
}

/// The closed loop's polynomial c(s) = s⁴ + k_j s³ + k_a s² + k_v s + k_p has
/// c(s) c(−s) = s⁸ + w (1 − s² + s⁴ − s⁶). Comparing powers gives one equation for k_a. Its largest
/// root belongs to the stable loop; Newton's iteration converges to it from above.
Gains calc_horizontal_gains(double weight) {
  const double position = sqrt(weight);
  double acceleration = 10.0 * (1.0 + weight);
  for (int i = 0; i < 200; ++i) {
    const double u = 2.0 * position * acceleration + weight, w = 2.0 * acceleration + weight;
    const double root = sqrt(u * w);  // k_v k_j
    const double value = acceleration * acceleration + 2.0 * position - 2.0 * root - weight;
    const double slope = 2.0 * acceleration - 2.0 * (position * w + u) / root;
    acceleration -= value / slope;
  }
  return (Gains){.position = position,
                 .velocity = sqrt(2.0 * position * acceleration + weight),
                 .acceleration = acceleration,
                 .jerk = sqrt(2.0 * acceleration + weight)};
}

LawFault calc_force(const Motion* motion, const double set_point[3], const Vehicle* vehicle,
                    const Gains* horizontal, const Gains* vertical, double f_Q_W[3]) {
  memset(f_Q_W, 0, 3 * sizeof f_Q_W[0]);
  double n[3], n_dot[3];  // the rod's direction, from quadrotor to load
  for (int i = kX; i <= kZ; ++i) {
    n[i] = (motion->p_WL[i] - motion->p_WQ[i]) / vehicle->rod_length;
    n_dot[i] = (motion->v_WL[i] - motion->v_WQ[i]) / vehicle->rod_length;
    if (!isfinite(n[i]) || !isfinite(n_dot[i])) return kNotFinite;
  }
  if (n[kZ] < kMinRodCosine) return kRodLevel;

  // Vertical: the load's acceleration, jerk and snap from the second-order closed loop.
  const double e_z = motion->p_WL[kZ] - set_point[kZ];
  const double a_z = -vertical->velocity * motion->v_WL[kZ] - vertical->position * e_z;
  const double j_z = -vertical->velocity * a_z - vertical->position * motion->v_WL[kZ];
  const double s_z = -vertical->velocity * j_z - vertical->position * a_z;
  const double support = vehicle->gravity - a_z;
  if (!isfinite(support)) return kNotFinite;
  if (support < kMinSupportFraction * vehicle->gravity) return kFreeFall;

  // Horizontal: the rod's slope w gives the load's acceleration, its second derivative the snap.
  double W[3] = {0, 0, 1}, W_dot[3] = {0}, W_ddot[3] = {0}, a_WL[3] = {0, 0, a_z};
  for (int i = kX; i <= kY; ++i) {
    W[i] = n[i] / n[kZ];
    W_dot[i] = (n_dot[i] - W[i] * n_dot[kZ]) / n[kZ];
    a_WL[i] = -support * W[i];
    const double jerk = j_z * W[i] - support * W_dot[i];
    const double snap = -horizontal->jerk * jerk - horizontal->acceleration * a_WL[i] -
                        horizontal->velocity * motion->v_WL[i] -
                        horizontal->position * (motion->p_WL[i] - set_point[i]);
    W_ddot[i] = (s_z * W[i] + 2.0 * j_z * W_dot[i] - snap) / support;
  }

  // The second derivative of W = ρ n gives the rod's acceleration.
  const double rho = sqrt(dot(W, W)), rho_dot = dot(n, W_dot);
  const double rho_ddot = dot(n_dot, W_dot) + dot(n, W_ddot);
  const double tension = vehicle->load_mass * support / n[kZ];
  for (int i = kX; i <= kZ; ++i) {
    const double n_ddot = (W_ddot[i] - rho_ddot * n[i] - 2.0 * rho_dot * n_dot[i]) / rho;
    const double gravity = i == kZ ? vehicle->gravity : 0.0;
    f_Q_W[i] =
        vehicle->quad_mass * (a_WL[i] - vehicle->rod_length * n_ddot - gravity) - tension * n[i];
  }
  if (isfinite(f_Q_W[kX]) && isfinite(f_Q_W[kY]) && isfinite(f_Q_W[kZ])) return kNoFault;
  memset(f_Q_W, 0, 3 * sizeof f_Q_W[0]);
  return kNotFinite;
}
