#include "control_client/laws/cooperative/cooperative_law.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "common/model/dot.hpp"
#include "common/model/math.hpp"
#include "common/model/rotation.hpp"

namespace sls::control {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using model::calc_antisymmetric_vector;
using model::SharedLoad;

Matrix3d to_cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// `of_W` seen from a body with attitude `R_WB`, whose rates are `w_B`.
Jet to_body(const Jet& of_W, const Matrix3d& R_WB, const Jet& w_B) {
  const Matrix3d R_BW = R_WB.transpose();
  const Vector3d first_B = R_BW * of_W.first;
  Jet seen;
  seen.value = R_BW * of_W.value;
  seen.first = first_B - w_B.value.cross(seen.value);
  seen.second = R_BW * of_W.second - w_B.value.cross(first_B) - w_B.first.cross(seen.value) -
                w_B.value.cross(seen.first);
  return seen;
}

/// The inverse of `to_body`.
Jet to_world(const Jet& of_B, const Matrix3d& R_WB, const Jet& w_B) {
  const Vector3d turned = w_B.value.cross(of_B.value);
  return {R_WB * of_B.value, R_WB * (of_B.first + turned),
          R_WB * (of_B.second + 2.0 * w_B.value.cross(of_B.first) + w_B.first.cross(of_B.value) +
                  w_B.value.cross(turned))};
}

/// Eq. (10): the unit vector against `of`.
Jet calc_opposite_direction(const Jet& of) {
  const double r = 1.0 / std::sqrt(of.value.squaredNorm());
  const double slope = model::dot(of.value, of.first);
  const double r_dot = -r * r * r * slope;
  const double r_ddot = -r * r * r * (of.first.squaredNorm() + model::dot(of.value, of.second)) -
                        3.0 * r * r * r_dot * slope;
  return {-r * of.value, -(r * of.first + r_dot * of.value),
          -(r * of.second + 2.0 * r_dot * of.first + r_ddot * of.value)};
}

}  // namespace

CooperativeLaw::CooperativeLaw(const SharedLoad& load, std::size_t vehicle,
                               const model::SlungLoadParameters& believed,
                               const CooperativeKeys& keys)
    : vehicle_(vehicle),
      believed_(believed),
      gains_(keys.gains),
      is_rigid_(load.inertia_L.has_value()),
      attachment_L_(load.cables.at(vehicle).attachment_L),
      distribution_(load) {
  for (const SharedLoad::Cable& cable : load.cables) load_mass_ += cable.load_share;
  load_mass_ *= believed.load_mass / load.cables[vehicle].load_share;
  if (is_rigid_) inertia_L_ = *load.inertia_L;
  const double share = load_mass_ * believed.gravity / static_cast<double>(load.cables.size());
  internal_L_ = distribution_.calc_internal(share * math::tan(keys.spread))[vehicle];
}

CooperativeLaw::Load CooperativeLaw::find_load(const model::Measurement& state) const {
  Load load{state.p_WL, state.v_WL, Matrix3d::Identity(), Vector3d::Zero()};
  if (!is_rigid_) return load;
  const auto q = state.signals.segment<4>(SharedLoad::kAttitude);
  load.R_WL = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  load.w_L = state.signals.segment<3>(SharedLoad::kRates);
  load.p_WL -= load.R_WL * attachment_L_;  // eq. (1)
  load.v_WL -= load.R_WL * load.w_L.cross(attachment_L_);
  return load;
}

void CooperativeLaw::plan_position(const Load& load, const LawInput& input,
                                   CooperativePlan& plan) const {
  const model::Reference& reference = input.load_reference;
  const double k_p = gains_.position, k_v = gains_.velocity;
  // Eqs. (2) and (3): the derivatives are those of the designed motion.
  const Vector3d e = load.p_WL - reference.position, e_dot = load.v_WL - reference.velocity;
  const Vector3d e_ddot = -k_v * e_dot - k_p * e;
  const Vector3d e_3 = -k_v * e_ddot - k_p * e_dot;
  const Vector3d e_4 = -k_v * e_3 - k_p * e_ddot;
  plan.a_WL = reference.acceleration + e_ddot;
  const Jet force_W{load_mass_ * (plan.a_WL - Vector3d(0.0, 0.0, believed_.gravity)),
                    load_mass_ * (reference.jerk + e_3), load_mass_ * (reference.snap + e_4)};
  plan.force_L = to_body(force_W, load.R_WL, plan.w_L);
}

void CooperativeLaw::plan_attitude(const Load& load, const LawInput& input,
                                   CooperativePlan& plan) const {
  plan.w_L = plan.moment_L = {Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
  if (!is_rigid_) return;
  const model::AttitudeReference& wanted = input.load_attitude;
  const double k_R = gains_.attitude, k_W = gains_.rates;
  const Matrix3d Q = wanted.R_WL.transpose() * load.R_WL, Q_T = Q.transpose();
  // The wanted rates and their derivatives, seen from the load.
  const Vector3d axis = Q_T * wanted.axis_L;
  const Vector3d d0 = wanted.turn[0] * axis, d1 = wanted.turn[1] * axis, d2 = wanted.turn[2] * axis,
                 d3 = wanted.turn[3] * axis;

  // Eq. (4), with the derivatives of the designed motion.
  const Vector3d e = load.w_L - d0;
  const Matrix3d E = to_cross_matrix(e);
  const Vector3d e_R = calc_antisymmetric_vector(Q), e_R_dot = calc_antisymmetric_vector(Q * E);
  const Vector3d e_dot = -k_R * e_R - k_W * e;
  const Vector3d e_R_ddot = calc_antisymmetric_vector(Q * (E * E + to_cross_matrix(e_dot)));
  const Vector3d e_ddot = -k_R * e_R_dot - k_W * e_dot;
  const Vector3d e_3 = -k_R * e_R_ddot - k_W * e_ddot;

  // The derivatives of QᵀΩ_d: those of Q add −e × to each.
  const Vector3d u1 = d1 - e.cross(d0), d1_dot = d2 - e.cross(d1), d2_dot = d3 - e.cross(d2);
  const Vector3d u2 = d1_dot - e_dot.cross(d0) - e.cross(u1);
  const Vector3d d1_ddot = d2_dot - e_dot.cross(d1) - e.cross(d1_dot);
  const Vector3d u3 = d1_ddot - e_ddot.cross(d0) - 2.0 * e_dot.cross(u1) - e.cross(u2);

  // Eq. (5).
  plan.w_L = {load.w_L, e_dot + u1, e_ddot + u2};
  const Vector3d w_3 = e_3 + u3;
  const Jet& w = plan.w_L;
  const Vector3d h = inertia_L_ * w.value, h_dot = inertia_L_ * w.first,
                 h_ddot = inertia_L_ * w.second;
  plan.moment_L = {
      h_dot + w.value.cross(h), h_ddot + w.first.cross(h) + w.value.cross(h_dot),
      inertia_L_ * w_3 + w.second.cross(h) + 2.0 * w.first.cross(h_dot) + w.value.cross(h_ddot)};
}

CooperativePlan CooperativeLaw::calc_plan(const LawInput& input) const {
  const Load load = find_load(input.state);
  CooperativePlan plan;
  plan.R_WL = load.R_WL;
  plan_attitude(load, input, plan);
  plan_position(load, input, plan);
  const auto share = [&](const Vector3d& force_L, const Vector3d& moment_L) {
    return distribution_.calc_share(vehicle_, force_L, moment_L);
  };
  const Jet pull_L{share(plan.force_L.value, plan.moment_L.value) + internal_L_,
                   share(plan.force_L.first, plan.moment_L.first),
                   share(plan.force_L.second, plan.moment_L.second)};
  plan.pull_W = to_world(pull_L, load.R_WL, plan.w_L);  // eq. (9)
  return plan;
}

LawOutput CooperativeLaw::calc(const LawInput& input) const {
  LawOutput output;
  const auto fail = [&](ErrorCode error_code) { return without_force(output, error_code); };
  const model::Measurement& state = input.state;
  if (state.signals.size() < SharedLoad::kSignals || !state.signals.allFinite())
    return fail(ErrorCode::kNotFinite);
  if (is_level(state.rod)) return fail(ErrorCode::kRodLevel);

  const CooperativePlan plan = calc_plan(input);
  const double support = -plan.pull_W.value.z();
  if (!std::isfinite(support)) return fail(ErrorCode::kNotFinite);
  if (support < kMinSupportFraction * believed_.load_mass * believed_.gravity)
    return fail(ErrorCode::kFreeFall);

  // Eq. (11): the own cable turns towards its wanted direction.
  const Jet d = calc_opposite_direction(plan.pull_W);
  const model::RodDirection rod = model::to_direction(state.rod);
  const Vector3d &n = rod.n_W, &n_dot = rod.n_dot_W;
  const Vector3d w_d = d.value.cross(d.first), w_d_dot = d.value.cross(d.second);
  const Vector3d error = d.value.cross(n);
  const Vector3d rate_error = n.cross(n_dot) + n.cross(n.cross(w_d));
  const Vector3d w_dot = -gains_.cable_angle * error - gains_.cable_rate * rate_error -
                         model::dot(n, w_d) * n_dot - n.cross(n.cross(w_d_dot));
  const Vector3d n_ddot = w_dot.cross(n) - n_dot.squaredNorm() * n;

  // Eq. (12): Newton's law of the vehicle, where the load moves as designed.
  const Jet& w = plan.w_L;
  const Vector3d a_WE = plan.a_WL + plan.R_WL * (w.first.cross(attachment_L_) +
                                                 w.value.cross(w.value.cross(attachment_L_)));
  const double length = state.signals[SharedLoad::kLength];
  output.f_Q_W =
      believed_.quad_mass * (a_WE - length * n_ddot - Vector3d(0.0, 0.0, believed_.gravity)) +
      model::dot(n, plan.pull_W.value) * n;
  if (!output.f_Q_W.allFinite()) return fail(ErrorCode::kNotFinite);
  return output;
}

std::unique_ptr<const ControlLaw> make_cooperative_law(const LawSetup& setup) {
  if (!setup.shared_load)
    throw config::ConfigError("controller.law: 'cooperative' expected a load that vehicles share");
  return std::make_unique<CooperativeLaw>(*setup.shared_load, setup.vehicle_id,
                                          setup.controller.model.vehicle,
                                          setup.controller.own.get<CooperativeKeys>());
}

}  // namespace sls::control
