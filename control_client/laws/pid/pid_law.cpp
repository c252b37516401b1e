#include "control_client/laws/pid/pid_law.hpp"

#include <cmath>

#include "control_client/laws/error_integral.hpp"

namespace sls::control {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

}  // namespace

LawOutput PidLaw::calc(const LawInput& input) const {
  LawOutput output;
  const auto fail = [&](ErrorCode error_code) { return without_force(output, error_code); };
  const PidAxisGains &xy = gains_.horizontal, &z = gains_.vertical;
  const model::RodDirection rod = model::to_direction(input.state.rod);
  const Vector3d &q = rod.n_W, &q_dot = rod.n_dot_W;
  const Vector3d integral = input.memory.head<3>();
  const double m = vehicle_.quad_mass, total_mass = vehicle_.total_mass();

  // Eq. (1): position error and velocity of the load by the controller's own model.
  const Vector3d error = input.reference.position - input.state.p_WQ - vehicle_.rod_length * q;
  const Vector3d velocity = input.state.v_WQ + vehicle_.rod_length * q_dot;
  if (is_level(input.state.rod)) return fail(ErrorCode::kRodLevel);

  // Eqs. (2) and (3): the position loop gives a desired velocity, the velocity loop a desired
  // acceleration.
  const Vector3d k_p(xy.position, xy.position, z.position);
  const Vector3d k_v(xy.velocity, xy.velocity, z.velocity);
  const Vector3d k_i(xy.integral, xy.integral, z.integral);
  const Vector3d acceleration =
      k_v.cwiseProduct(k_p.cwiseProduct(error) - velocity) + k_i.cwiseProduct(integral);
  const double support = vehicle_.gravity - acceleration.z();
  if (!std::isfinite(support)) return fail(ErrorCode::kNotFinite);
  if (support < kMinSupportFraction * vehicle_.gravity) return fail(ErrorCode::kFreeFall);

  // Eq. (4): the acceleration gives a desired slope of the rod, and its error the acceleration of
  // the slope.
  const Vector2d w = q.head<2>() / q.z();
  const Vector2d w_dot = (q_dot.head<2>() - w * q_dot.z()) / q.z();
  const Vector2d wanted_w = -acceleration.head<2>() / support;
  const Vector2d w_ddot = xy.rod_angle * (wanted_w - w) - xy.rod_rate * w_dot;

  // Eq. (5): the force carries both bodies along the rod and turns it.
  output.f_Q_W.head<2>() = -total_mass * support * w - m * vehicle_.rod_length * w_ddot;
  output.f_Q_W.z() = -total_mass * support;
  if (!output.f_Q_W.allFinite()) return fail(ErrorCode::kNotFinite);
  output.memory = calc_next_integral(integral, error, period_);
  return output;
}

std::unique_ptr<const ControlLaw> make_pid_law(const LawSetup& setup) {
  return std::make_unique<PidLaw>(setup.controller.model.vehicle,
                                  setup.controller.own.get<PidKeys>().gains, setup.period);
}

}  // namespace sls::control
