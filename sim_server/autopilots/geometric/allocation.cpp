#include "sim_server/autopilots/geometric/allocation.hpp"

#include <algorithm>

#include "sim_server/autopilots/rotor_wrenches.hpp"

namespace sls::sim::geometric {

using Eigen::Index, Eigen::VectorXd;

Allocation::Allocation(const AutopilotSetup& setup) : largest_(setup.airframe.rotors.size()) {
  const bool has_yaw = find_yaw_authority(setup);
  const auto wrenches = calc_rotor_wrenches(setup.airframe);
  Eigen::MatrixXd effects(4, wrenches.cols());
  effects << wrenches.topRows<3>(), -wrenches.bottomRows<1>();
  if (!has_yaw) effects.row(2).setZero();
  // Eq. (8). A row of zeros gives a column of zeros.
  shares_ = calc_pseudo_inverse(effects);
  for (std::size_t i = 0; i < setup.airframe.rotors.size(); ++i) {
    const Rotor& rotor = setup.airframe.rotors[i];
    largest_[static_cast<Index>(i)] = rotor.thrust_constant * rotor.max_speed * rotor.max_speed;
  }
}

VectorXd Allocation::calc_thrusts(const Eigen::Vector3d& moment, double thrust) const {
  const VectorXd tilting = shares_.leftCols<2>() * moment.head<2>();
  const VectorXd lifting = shares_.col(3), turning = shares_.col(2) * moment.z();
  // `most`: `thrust`, or less if a rotor would exceed its largest thrust. `least`: below it a rotor
  // would have to push down. `least` has priority.
  double most = thrust, least = 0.0;
  for (Index i = 0; i < lifting.size(); ++i) {
    if (!(lifting[i] > 0.0)) continue;
    most = std::min(most, (largest_[i] - tilting[i]) / lifting[i]);
    least = std::max(least, -tilting[i] / lifting[i]);
  }
  const VectorXd level = tilting + std::max(least, most) * lifting;
  // The part of the yaw moment (0 … 1) that keeps every rotor within its limits.
  double part = 1.0;
  for (Index i = 0; i < turning.size(); ++i) {
    const double room = turning[i] > 0.0 ? largest_[i] - level[i] : level[i];
    if (std::abs(turning[i]) * part > room) part = std::max(0.0, room) / std::abs(turning[i]);
  }
  return (level + part * turning).cwiseMax(0.0).cwiseMin(largest_);
}

}  // namespace sls::sim::geometric
