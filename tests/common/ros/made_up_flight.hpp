/// Made-up samples, not from a simulation: all numbers differ, and a test finds swapped fields.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "common/ros/mirrors.hpp"

namespace sls::test {

inline const std::vector<std::uint32_t> kMadeUpVehicles = {0, 3};
inline constexpr std::int64_t kMadeUpPeriodNs = 4'000'000;

/// A tumbling flight on a circle with radius 2 m, one turn in 6 s. The centre is (1, 2, −3) m, plus
/// 10 m in x per vehicle id. No reference at steps 500 to 509.
inline ros::VehicleSample make_sample(std::uint32_t vehicle_id, std::uint64_t step) {
  ros::VehicleSample sample;
  sample.vehicle_id = vehicle_id;
  sample.step = step;
  sample.sim_time_ns = static_cast<std::int64_t>(step) * kMadeUpPeriodNs;
  const double time = 1e-9 * static_cast<double>(sample.sim_time_ns);
  const double angle = 2 * M_PI / 6 * time, rate = 2 * M_PI / 6;
  const Eigen::Vector3d center(1 + 10.0 * vehicle_id, 2, -3);
  sample.p_WQ = center + 2 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
  sample.v_WQ = 2 * rate * Eigen::Vector3d(-std::sin(angle), std::cos(angle), 0.1);
  sample.q_WB = Eigen::AngleAxisd(0.3 + time, Eigen::Vector3d(1, 2, -2).normalized());
  sample.w_WB_B = {0.1 + time, -0.2, 0.3};
  sample.p_WL = sample.p_WQ + Eigen::Vector3d(0.1, -0.2, 0.8);
  sample.v_WL = sample.v_WQ + Eigen::Vector3d(0.01, 0.02, 0.03);
  if (step < 500 || step >= 510) sample.reference = sample.p_WL + Eigen::Vector3d(0.5, 0.6, 0.7);
  return sample;
}

}  // namespace sls::test
