/// One load on cables in pictures: the page of sls_view, Foxglove, MCAP readers and ROS tools draw
/// this. Positions in W (z down), SI units.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <map>
#include <optional>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/model/shared_load.hpp"

namespace sls::scene {

/// Red, green, blue, 0 to 1.
using Colour = std::array<float, 3>;

/// Of cables: slack, taut without tension, taut with `full_tension` or more; between them linear.
inline constexpr Colour kSlackColour = {0.60F, 0.63F, 0.67F};
inline constexpr Colour kLowColour = {0.13F, 0.40F, 0.67F};
inline constexpr Colour kHighColour = {0.84F, 0.15F, 0.16F};

/// The load of a run.
struct LoadScene {
  std::map<std::uint32_t, Eigen::Vector3d> attachments_L;  ///< of each vehicle's cable
  /// The outline of a rigid load: its attachments, in turn around it; empty: a point.
  std::vector<Eigen::Vector3d> outline_L;
  double full_tension = 1.0;  ///< twice a vehicle's share of the weight, N
  std::optional<double> ground_z_W;
  std::optional<std::size_t> released_signal;  ///< index of `cable_released`
};

/// The load of a run whose vehicles carry it together by cables; none: each vehicle has its own, or
/// the scenario cannot be read.
std::optional<LoadScene> read_load_scene(const Parameters& parameters);

/// One vehicle's cable at one step.
struct Cable {
  double tension = 0.0, length = 0.0;  ///< N, m
  bool is_taut = false, is_released = false;
  Eigen::Quaterniond q_WL = Eigen::Quaterniond::Identity();  ///< of the load
  Eigen::Vector3d w_WL_L = Eigen::Vector3d::Zero();          ///< of the load, rad/s
};

/// Reads the cable from a vehicle's signals; none if there are too few.
std::optional<Cable> read_cable(const LoadScene& scene, const std::vector<double>& signals);

/// A colour for the state and tension of a cable.
Colour calc_colour(const LoadScene& scene, const Cable& cable);

/// The points of a cable from its vehicle to its load: both ends if it is taut; a catenary of its
/// length if it is slack, which lies on the ground where it would hang below.
std::vector<Eigen::Vector3d> calc_cable_points(const LoadScene& scene, const Cable& cable,
                                               const Eigen::Vector3d& vehicle_W,
                                               const Eigen::Vector3d& end_W);

/// A cable of this length that hangs from `from` to `to`: the ends and kHangingPoints − 2 points
/// between, evenly spaced along it except that the lowest is one of them. A straight line, of the
/// ends alone, if it is no longer than their distance.
std::vector<Eigen::Vector3d> calc_hanging_points(const Eigen::Vector3d& from,
                                                 const Eigen::Vector3d& to, double length);
inline constexpr int kHangingPoints = 25;

}  // namespace sls::scene
