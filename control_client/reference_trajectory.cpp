#include "control_client/reference_trajectory.hpp"

#include <cmath>

#include "common/model/math.hpp"
#include "common/model/rotation.hpp"

namespace sls::control {
namespace {

constexpr double kTwoPi = 6.283185307179586476925286766559;

/// Eq. (13), the polynomial that rises from 0 to 1 on [0, 1]. The upper half is computed from the
/// lower half by point symmetry, because cancellation of its terms would lose digits.
double calc_blend(double tau) {
  if (tau > 0.5) return 1.0 - calc_blend(1.0 - tau);
  const double square = tau * tau;
  return square * square * tau *
         (126.0 + tau * (-420.0 + tau * (540.0 + tau * (-315.0 + tau * 70.0))));
}

std::unique_ptr<const ReferenceTrajectory> make(const config::ConstantReference& config) {
  return std::make_unique<Constant>(config);
}
std::unique_ptr<const ReferenceTrajectory> make(const config::FigureEightReference& config) {
  return std::make_unique<FigureEight>(config);
}
std::unique_ptr<const ReferenceTrajectory> make(const config::RestToRestReference& config) {
  return std::make_unique<RestToRest>(config);
}

Eigen::Quaterniond to_quaternion(const config::StageAttitude& attitude,
                                 const Eigen::Quaterniond& otherwise) {
  return attitude ? model::make_attitude(attitude->x(), attitude->y(), attitude->z()) : otherwise;
}

}  // namespace

model::Reference Constant::calc(double) const {
  model::Reference reference;
  reference.position = config_.position;
  return reference;
}

model::Reference FigureEight::calc(double time) const {
  // Eq. (12). Each derivative of sin ωt brings one factor ω and turns sin → cos → −sin → −cos.
  const Eigen::Array3d amplitude = config_.amplitude.array();
  const double base = kTwoPi / config_.period_s;
  const Eigen::Array3d omega(base, 2.0 * base, base);
  const math::SineCosine once = math::sincos(base * time), twice = math::sincos(2.0 * base * time);
  const Eigen::Array3d sine(once.sine, twice.sine, once.sine);
  const Eigen::Array3d cosine(once.cosine, twice.cosine, once.cosine);
  model::Reference reference;
  reference.position = config_.offset + (amplitude * sine).matrix();
  reference.velocity = amplitude * omega * cosine;
  reference.acceleration = -amplitude * omega.square() * sine;
  reference.jerk = -amplitude * omega.cube() * cosine;
  reference.snap = amplitude * omega.square().square() * sine;
  return reference;
}

model::Reference RestToRest::calc(double time) const {
  model::Reference reference;
  const double duration = config_.duration_s;
  if (time <= 0.0 || time >= duration) {
    reference.position = time <= 0.0 ? config_.from : config_.to;
    return reference;
  }
  // Eq. (13). With u = τ (1 − τ) and u′ = 1 − 2τ the first derivative is 630 u⁴.
  const double tau = time / duration;
  const double u = tau * (1.0 - tau), u_dot = 1.0 - 2.0 * tau;
  const Eigen::Vector3d way = config_.to - config_.from;
  const double u2 = u * u, rate = 1.0 / duration, rate2 = rate * rate;
  reference.position = config_.from + way * calc_blend(tau);
  reference.velocity = way * (rate * 630.0 * u2 * u2);
  reference.acceleration = way * (rate2 * 2520.0 * u2 * u * u_dot);
  reference.jerk = way * (rate2 * rate * 2520.0 * u2 * (3.0 * u_dot * u_dot - 2.0 * u));
  reference.snap = way * (rate2 * rate2 * 15120.0 * u * u_dot * (u_dot * u_dot - 3.0 * u));
  return reference;
}

std::unique_ptr<const ReferenceTrajectory> make_reference_trajectory(
    const config::StageReference& reference) {
  return std::visit([](const auto& config) { return make(config); }, reference);
}

AttitudeTrajectory::AttitudeTrajectory(const config::StageReference& reference,
                                       const Eigen::Quaterniond& q_start)
    : q_from_(q_start) {
  const auto begin_with = [&](const config::StageAttitude& attitude) {
    turns_ = attitude.has_value();
    q_from_ = to_quaternion(attitude, q_start);
  };
  if (const auto* constant = std::get_if<config::ConstantReference>(&reference))
    begin_with(constant->attitude);
  if (const auto* eight = std::get_if<config::FigureEightReference>(&reference))
    begin_with(eight->attitude);
  if (const auto* rest = std::get_if<config::RestToRestReference>(&reference)) {
    begin_with(rest->from_attitude);
    turns_ = turns_ || rest->to_attitude;
    turn_to(to_quaternion(rest->to_attitude, q_start), rest->duration_s);
  }
}

void AttitudeTrajectory::turn_to(const Eigen::Quaterniond& q_to, double duration_s) {
  Eigen::Quaterniond turn = q_from_.conjugate() * q_to;
  if (turn.w() < 0.0) turn.coeffs() *= -1.0;  // the shorter way
  const double sine = std::sqrt(turn.vec().squaredNorm());
  constexpr double kRounding = 1e-15;  // of products of unit quaternions
  if (sine <= kRounding) return;
  axis_ = turn.vec() / sine;
  const double angle = 2.0 * math::atan2(sine, turn.w());
  config::RestToRestReference way;
  way.to.x() = angle;
  way.duration_s = duration_s;
  angle_.emplace(way);
}

model::AttitudeReference AttitudeTrajectory::calc(double time) const {
  model::AttitudeReference attitude;
  attitude.axis_L = axis_;
  Eigen::Quaterniond q = q_from_;
  if (angle_) {
    const model::Reference angle = angle_->calc(time);
    attitude.turn << angle.velocity.x(), angle.acceleration.x(), angle.jerk.x(), angle.snap.x();
    q = q_from_ * model::make_turn(angle.position.x(), axis_);
  }
  attitude.R_WL = q.toRotationMatrix();
  return attitude;
}

model::Reference calc_end_reference(const model::Reference& load,
                                    const model::AttitudeReference& attitude,
                                    const Eigen::Vector3d& attachment_L) {
  const Eigen::Matrix3d& R = attitude.R_WL;
  const Eigen::Vector3d across = attitude.axis_L.cross(attachment_L);  // the first derivative
  const Eigen::Vector3d first = R * across, second = R * attitude.axis_L.cross(across);
  const double w = attitude.turn[0], a = attitude.turn[1], j = attitude.turn[2],
               s = attitude.turn[3];
  model::Reference end = load;
  end.position += R * attachment_L;
  end.velocity += w * first;
  end.acceleration += a * first + w * w * second;
  end.jerk += (j - w * w * w) * first + 3.0 * w * a * second;
  end.snap += (s - 6.0 * w * w * a) * first + (4.0 * w * j + 3.0 * a * a - w * w * w * w) * second;
  return end;
}

}  // namespace sls::control
