#include "control_client/laws/qsf/qsf_law.hpp"

#include <cmath>

#include "common/model/dot.hpp"
#include "common/model/math.hpp"
#include "control_client/laws/error_integral.hpp"
#include "control_client/laws/qsf/lqr.hpp"

namespace sls::control {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Desired vertical acceleration of the load and its derivatives along the assumed closed loop.
struct VerticalMotion {
  double n = 0.0;       ///< n₃, m/s²
  double n_dot = 0.0;   ///< n₃′, m/s³
  double n_ddot = 0.0;  ///< n₃″, m/s⁴
};

VerticalMotion calc_vertical(const QsfInput& input, const Vector3d& error,
                             const Vector3d& error_dot, const AxisGains& gain) {
  const model::Reference& reference = input.reference;
  const double e = error.z(), e_dot = error_dot.z(), integral = input.integral.z();
  // While the integral is clamped its derivative is 0, not e.
  const double moving = is_clamped(integral, e) ? 0.0 : gain.integral;
  VerticalMotion z;
  z.n = reference.acceleration.z() - gain.velocity * e_dot - gain.position * e -
        gain.integral * integral;  // Eq. (2)
  const double e_ddot = z.n - reference.acceleration.z();
  z.n_dot =
      reference.jerk.z() - gain.velocity * e_ddot - gain.position * e_dot - moving * e;  // (3)
  const double e_dddot = z.n_dot - reference.jerk.z();
  z.n_ddot = reference.snap.z() - gain.velocity * e_dddot - gain.position * e_ddot -
             moving * e_dot;  // Eq. (4)
  return z;
}

/// Desired horizontal snap of the load, eq. (6).
Vector2d calc_horizontal(const QsfInput& input, const Vector3d& error, const Vector3d& error_dot,
                         const Vector2d& acceleration, const Vector2d& jerk,
                         const AxisGains& gain) {
  const model::Reference& reference = input.reference;
  return reference.snap.head<2>() - gain.jerk * (jerk - reference.jerk.head<2>()) -
         gain.acceleration * (acceleration - reference.acceleration.head<2>()) -
         gain.velocity * error_dot.head<2>() - gain.position * error.head<2>() -
         gain.integral * input.integral.head<2>();
}

/// q̈ of q = W/|W|, W = (w, 1), by differentiating the normalisation twice. Eq. (8).
Vector3d calc_rod_acceleration(const Vector2d& w, const Vector2d& w_dot, const Vector2d& w_ddot) {
  const Vector3d W(w.x(), w.y(), 1.0), W_dot(w_dot.x(), w_dot.y(), 0.0),
      W_ddot(w_ddot.x(), w_ddot.y(), 0.0);
  const double r = 1.0 / W.norm();
  const double W_W_dot = model::dot(W, W_dot);
  const double r_dot = -r * r * r * W_W_dot;
  const double r_ddot =
      -r * r * r * (W_dot.squaredNorm() + model::dot(W, W_ddot)) - 3.0 * r * r * r_dot * W_W_dot;
  return r * W_ddot + 2.0 * r_dot * W_dot + r_ddot * W;
}

}  // namespace

QsfOutput calc_qsf(const QsfInput& input, const model::SlungLoadParameters& vehicle,
                   const NamedGains& gains) {
  QsfOutput output;
  const auto fail = [&](ErrorCode error_code) { return without_force(output, error_code); };

  // Eq. (1): error of the load position by the controller's own model.
  const model::RodDirection rod = model::to_direction(input.rod);
  const Vector3d& q = rod.n_W;
  const Vector3d& q_dot = rod.n_dot_W;
  const Vector3d e = input.p_WQ + vehicle.rod_length * q - input.reference.position;
  const Vector3d e_dot = input.v_WQ + vehicle.rod_length * q_dot - input.reference.velocity;
  if (!e.allFinite() || !e_dot.allFinite()) return fail(ErrorCode::kNotFinite);
  output.load_error = e;
  output.integral_rate << (gains.horizontal.integral != 0.0 ? e.x() : 0.0),
      (gains.horizontal.integral != 0.0 ? e.y() : 0.0),
      (gains.vertical.integral != 0.0 ? e.z() : 0.0);
  if (is_level(input.rod)) return fail(ErrorCode::kRodLevel);

  const VerticalMotion z = calc_vertical(input, e, e_dot, gains.vertical);
  const double s = vehicle.gravity - z.n;
  if (!std::isfinite(s)) return fail(ErrorCode::kNotFinite);
  if (s < input.least_support * vehicle.gravity) return fail(ErrorCode::kFreeFall);

  // Eq. (5): the rod's slope determines the horizontal acceleration and jerk of the load.
  const Vector2d w = q.head<2>() / q.z();
  const Vector2d w_dot = (q_dot.head<2>() - w * q_dot.z()) / q.z();
  const Vector2d acceleration = -s * w;
  const Vector2d jerk = z.n_dot * w - s * w_dot;

  const Vector2d snap = calc_horizontal(input, e, e_dot, acceleration, jerk, gains.horizontal);
  const Vector2d w_ddot = (z.n_ddot * w + 2.0 * z.n_dot * w_dot - snap) / s;  // Eq. (7)
  const Vector3d q_ddot = calc_rod_acceleration(w, w_dot, w_ddot);

  // Eq. (9): tension that carries the load, then Newton's law of the quadrotor.
  const double tension = vehicle.load_mass * s / q.z();
  const Vector3d a_WL(acceleration.x(), acceleration.y(), z.n);
  const Vector3d a_WQ = a_WL - vehicle.rod_length * q_ddot;
  output.f_Q_W = vehicle.quad_mass * (a_WQ - Vector3d(0.0, 0.0, vehicle.gravity)) - tension * q;
  if (!output.f_Q_W.allFinite()) return fail(ErrorCode::kNotFinite);
  return output;
}

LawOutput QsfLaw::calc(const LawInput& input) const {
  const Vector3d integral = input.memory.head<3>();
  QsfInput seen{input.state.p_WQ, input.state.v_WQ, input.state.rod, input.reference, integral};
  const auto fly_slack = [&]() -> LawOutput {
    return {slack_->calc_force(input.state, input.reference), input.memory, ErrorCode::kNone};
  };
  if (slack_) {
    if (input.state.signals.size() < slack_->signals_size())
      return without_force(LawOutput{{}, input.memory, {}}, ErrorCode::kNotFinite);
    if (slack_->applies(input.state)) return fly_slack();
    seen.least_support = SlackRule::kLeastSupport;
  }
  const QsfOutput qsf = calc_qsf(seen, vehicle_, gains_);
  if (slack_ && qsf.error_code == ErrorCode::kFreeFall) return fly_slack();
  return {qsf.f_Q_W, calc_next_integral(integral, qsf.integral_rate, period_), qsf.error_code};
}

std::unique_ptr<const ControlLaw> make_qsf_law(const LawSetup& setup) {
  const auto& keys = setup.controller.own.get<QsfKeys>();
  const NamedGains gains = make_named_gains(keys.gains);
  const model::SlungLoadParameters& vehicle = setup.controller.model.vehicle;
  std::optional<SlackRule> slack;
  if (keys.retaut_rate && setup.shared_load)  // else no plant with such signals
    slack.emplace(vehicle, gains.vertical, *keys.retaut_rate, setup.period,
                  setup.shared_load->released);
  return std::make_unique<QsfLaw>(vehicle, gains, setup.period, slack);
}

}  // namespace sls::control
