#include "control_client/reference_trajectory.hpp"

#include "common/model/math.hpp"

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

}  // namespace sls::control
