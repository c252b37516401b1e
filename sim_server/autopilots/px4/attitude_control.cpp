#include "sim_server/autopilots/px4/attitude_control.hpp"

#include <cmath>

#include "common/model/dot.hpp"
#include "common/model/math.hpp"

namespace sls::sim::px4 {
namespace {

using Eigen::Quaterniond, Eigen::Vector3d;

/// The quaternion of the same rotation, q or −q, that turns by at most half a turn.
Quaterniond to_shorter(const Quaterniond& q) { return q.w() < 0.0 ? Quaterniond(-q.coeffs()) : q; }

/// The shortest turn from the unit vector `from` to the unit vector `to`, which is not −`from`.
Quaterniond make_shortest_turn(const Vector3d& from, const Vector3d& to) {
  const double root = std::sqrt((1.0 + model::dot(to, from)) * 2.0);
  Quaterniond turn;
  turn.vec() = from.cross(to) * (1.0 / root);
  turn.w() = root * 0.5;
  return turn;
}

/// Eq. (3): the attitude with the wanted z axis that is nearest to `q_WB`.
Quaterniond calc_reduced_attitude(const Quaterniond& q_WB, const Quaterniond& q_WB_wanted) {
  constexpr double kOpposite = 1e-10;
  const Vector3d from = q_WB * Vector3d::UnitZ(), to = q_WB_wanted * Vector3d::UnitZ();
  // Half a turn has no unique axis: the desired attitude itself is then the result.
  if (1.0 + model::dot(from, to) < kOpposite) return q_WB_wanted;
  return make_shortest_turn(from.normalized(), to.normalized()) * q_WB;
}

}  // namespace

Vector3d calc_rate_set_points(const Quaterniond& q_WB, const Quaterniond& q_WB_wanted,
                              const AttitudeGains& gains) {
  const Quaterniond reduced = calc_reduced_attitude(q_WB, q_WB_wanted);
  // Eq. (4). Both z axes agree, so the remaining rotation is about z.
  const Quaterniond yaw = to_shorter(reduced.conjugate() * q_WB_wanted);
  const double half_angle = gains.yaw_weight * math::atan2(yaw.z(), yaw.w());
  const auto [sine, cosine] = math::sincos(half_angle);
  const Quaterniond wanted = reduced * Quaterniond(cosine, 0.0, 0.0, sine);
  // Eq. (5).
  const Vector3d error = 2.0 * to_shorter(q_WB.conjugate() * wanted).vec();
  // Eq. (6). The division cancels the weight for a small error of yaw alone.
  Vector3d per_rad = gains.per_rad;
  constexpr double kNoWeight = 1e-4;
  if (gains.yaw_weight > kNoWeight) per_rad.z() /= gains.yaw_weight;
  return error.cwiseProduct(per_rad).cwiseMin(gains.rate_limits).cwiseMax(-gains.rate_limits);
}

}  // namespace sls::sim::px4
