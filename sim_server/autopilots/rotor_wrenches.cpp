#include "sim_server/autopilots/rotor_wrenches.hpp"

#include <Eigen/SVD>

namespace sls::sim {
namespace {

constexpr double kRelativeZero = 1e-9;  // larger than the rounding error of a zero

/// Number of independent rows of `matrix`. Rows are normalised first, because their units differ.
int count_independent(Eigen::MatrixXd matrix) {
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    if (const double norm = matrix.row(row).norm(); norm > kRelativeZero) matrix.row(row) /= norm;
  Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix);
  svd.setThreshold(kRelativeZero);
  return static_cast<int>(svd.rank());
}

/// Rows: roll, pitch, thrust. Columns: rotors.
Eigen::MatrixXd list_tilting(const Airframe& airframe) {
  const auto wrenches = calc_rotor_wrenches(airframe);
  Eigen::MatrixXd rows(3, wrenches.cols());
  rows << wrenches.topRows<2>(), wrenches.bottomRows<1>();
  return rows;
}

/// The same rows, then yaw.
Eigen::MatrixXd list_effects(const Airframe& airframe) {
  Eigen::MatrixXd rows = list_tilting(airframe);
  rows.conservativeResize(4, Eigen::NoChange);
  rows.row(3) = calc_rotor_wrenches(airframe).row(2);
  return rows;
}

}  // namespace

Eigen::Matrix<double, 6, Eigen::Dynamic> calc_rotor_wrenches(const Airframe& airframe) {
  Eigen::Matrix<double, 6, Eigen::Dynamic> wrenches(6, airframe.rotors.size());
  for (std::size_t i = 0; i < airframe.rotors.size(); ++i) {
    const Rotor& rotor = airframe.rotors[i];
    const Eigen::Vector3d torque = (rotor.p_BR - airframe.p_BC).cross(rotor.axis_B) -
                                   rotor.spin * rotor.torque_constant * rotor.axis_B;
    wrenches.col(static_cast<Eigen::Index>(i)) << torque, rotor.axis_B;
  }
  return wrenches;
}

Eigen::MatrixXd calc_pseudo_inverse(const Eigen::MatrixXd& matrix) {
  Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeThinU | Eigen::ComputeThinV);
  svd.setThreshold(kRelativeZero);
  const Eigen::Index rank = svd.rank();
  return svd.matrixV().leftCols(rank) *
         svd.singularValues().head(rank).cwiseInverse().asDiagonal() *
         svd.matrixU().leftCols(rank).transpose();
}

bool has_yaw_authority(const Airframe& airframe) {
  return count_independent(list_effects(airframe)) > count_independent(list_tilting(airframe));
}

bool find_yaw_authority(const AutopilotSetup& setup) {
  if (count_independent(list_tilting(setup.airframe)) < 3)
    throw make_setup_error(setup, "plant.rotors",
                           "expected rotors that roll and pitch the body, got " +
                               std::to_string(setup.airframe.rotors.size()) + " that cannot");
  return has_yaw_authority(setup.airframe);
}

config::ConfigError make_setup_error(const AutopilotSetup& setup, const std::string& key,
                                     const std::string& message) {
  return config::ConfigError(setup.autopilot.model.describe_place(key) + ": " + message);
}

}  // namespace sls::sim
