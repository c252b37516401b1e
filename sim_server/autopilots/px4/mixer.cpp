#include "sim_server/autopilots/px4/mixer.hpp"

#include <algorithm>
#include <cmath>

#include "sim_server/autopilots/rotor_wrenches.hpp"

namespace sls::sim::px4 {
namespace {

using Eigen::Index, Eigen::VectorXd;

struct Limits {
  double least;
  double most;
};
constexpr Limits kOutputs{0.0, 1.0};
// Yaw may exceed the upper limit by this much; the thrust is then reduced to make room.
constexpr Limits kOutputsWithYaw{0.0, 1.15};

enum class Direction { kBoth, kLessOnly };

/// The multiple of `column` to add to `outputs` to bring them back between their limits: k of
/// eq. (13).
double calc_relief(const VectorXd& column, const VectorXd& outputs, const Limits& limits) {
  constexpr double kNoEffect = 1e-7;
  double least = 0.0, most = 0.0;
  for (Index i = 0; i < outputs.size(); ++i) {
    if (std::abs(column[i]) < kNoEffect) continue;
    const double inside = std::max(limits.least, std::min(limits.most, outputs[i]));
    const double relief = (inside - outputs[i]) / column[i];
    least = std::min(least, relief);
    most = std::max(most, relief);
  }
  return least + most;
}

/// Eq. (13).
void relieve(const VectorXd& column, const Limits& limits, Direction direction, VectorXd& outputs) {
  const double relief = calc_relief(column, outputs, limits);
  if (direction == Direction::kLessOnly && relief > 0.0) return;
  outputs += relief * column;
  // If both ends exceed their limits at once, they share the excess equally.
  outputs += 0.5 * calc_relief(column, outputs, limits) * column;
}

/// Axes and directions in which more torque would move a rotor further below its lower limit.
Saturation find_saturation(const std::vector<MixerRow>& mixer, const VectorXd& outputs) {
  constexpr double kAtLowerLimit = 0.005;
  Saturation saturation;
  for (std::size_t i = 0; i < mixer.size(); ++i) {
    if (outputs[static_cast<Index>(i)] >= kAtLowerLimit) continue;
    const double shares[] = {mixer[i].roll, mixer[i].pitch, mixer[i].yaw};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (shares[axis] > 0.0) saturation.negative[axis] = true;
      if (shares[axis] < 0.0) saturation.positive[axis] = true;
    }
  }
  return saturation;
}

double calc_root_mean_square(const VectorXd& column) {
  return column.norm() / std::sqrt(static_cast<double>(column.size()));
}

}  // namespace

std::vector<MixerRow> make_mixer(const AutopilotSetup& setup) {
  const std::vector<Rotor>& rotors = setup.airframe.rotors;
  const bool has_yaw = find_yaw_authority(setup);
  Eigen::MatrixXd wrenches = calc_rotor_wrenches(setup.airframe);
  if (!has_yaw) wrenches.row(2).setZero();
  // An output sets a speed. At equal speeds the thrusts are in proportion to the rotors' constants.
  double mean_constant = 0.0;
  for (const Rotor& rotor : rotors)
    mean_constant += rotor.thrust_constant / static_cast<double>(rotors.size());
  for (std::size_t i = 0; i < rotors.size(); ++i)
    wrenches.col(static_cast<Index>(i)) *= rotors[i].thrust_constant / mean_constant;

  // Eq. (12). Column k: the outputs that make torque or force k alone; thrust is along −z.
  const Eigen::MatrixXd shares = calc_pseudo_inverse(wrenches);
  const VectorXd roll = shares.col(0), pitch = shares.col(1), yaw = shares.col(2),
                 thrust = -shares.col(5);
  const double tilt_scale =
      std::sqrt(2.0) * std::max(calc_root_mean_square(roll), calc_root_mean_square(pitch));
  const double yaw_scale = has_yaw ? yaw.cwiseAbs().maxCoeff() : 1.0;
  const auto lifting = (thrust.array().abs() > 1e-9 * thrust.cwiseAbs().maxCoeff()).count();
  const double thrust_scale = thrust.sum() / static_cast<double>(lifting);
  std::vector<MixerRow> mixer;
  for (Index i = 0; i < shares.rows(); ++i)
    mixer.push_back({roll[i] / tilt_scale, pitch[i] / tilt_scale, yaw[i] / yaw_scale,
                     thrust[i] / thrust_scale});
  return mixer;
}

MixerOutput mix(const std::vector<MixerRow>& mixer, const Eigen::Vector3d& torque, double thrust) {
  const auto count = static_cast<Index>(mixer.size());
  VectorXd roll(count), pitch(count), yaw(count), lift(count);
  for (Index i = 0; i < count; ++i) {
    const MixerRow& row = mixer[static_cast<std::size_t>(i)];
    roll[i] = row.roll;
    pitch[i] = row.pitch;
    yaw[i] = row.yaw;
    lift[i] = row.thrust;
  }
  const Eigen::Vector3d wanted = torque.cwiseMax(-1.0).cwiseMin(1.0);
  MixerOutput result;
  VectorXd& outputs = result.outputs;
  outputs = wanted.x() * roll + wanted.y() * pitch + std::max(0.0, std::min(1.0, thrust)) * lift;
  relieve(lift, kOutputs, Direction::kLessOnly, outputs);
  relieve(roll, kOutputs, Direction::kBoth, outputs);
  relieve(pitch, kOutputs, Direction::kBoth, outputs);
  outputs += wanted.z() * yaw;
  relieve(yaw, kOutputsWithYaw, Direction::kBoth, outputs);
  relieve(lift, kOutputs, Direction::kLessOnly, outputs);
  outputs = outputs.cwiseMax(kOutputs.least).cwiseMin(kOutputs.most).eval();
  result.saturation = find_saturation(mixer, outputs);
  return result;
}

}  // namespace sls::sim::px4
