/// The visualization_msgs/MarkerArray of one vehicle: body, rod, load, and trails of load and
/// reference, all in the frame `world`. Instead of the rod a cable; then the load, its outline and
/// the ground are those of the first vehicle.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/ros/cdr_writer.hpp"
#include "common/ros/parts.hpp"
#include "common/scene/load_scene.hpp"

namespace sls::ros {

/// The last points of a path, at least `kLeastStep` apart.
class Trail {
 public:
  static constexpr std::size_t kMostPoints = 128;
  static constexpr double kLeastStep = 0.02;  ///< m; a hovering body adds no points

  void add(const Eigen::Vector3d& point);
  const std::vector<Eigen::Vector3d>& points() const { return points_; }

 private:
  std::vector<Eigen::Vector3d> points_;
};

struct LoadOnCable {
  const scene::LoadScene& scene;
  const scene::Cable& cable;
};

class VehicleMarkers {
 public:
  static constexpr std::int64_t kPeriodNs = 50'000'000;

  explicit VehicleMarkers(std::uint32_t vehicle_id);

  /// True if the markers must be written now: once in each period of simulation time.
  bool is_due(std::int64_t sim_time_ns) const { return sim_time_ns >= next_ns_; }

  /// Writes a MarkerArray. Positions in `world`; `load`: the end of the cable.
  void write(CdrWriter& cdr, std::int64_t sim_time_ns, const Pose& quadrotor,
             const Eigen::Vector3d& load, const std::optional<Eigen::Vector3d>& reference,
             const std::optional<LoadOnCable>& on_cable = {});

 private:
  std::uint32_t vehicle_id_;
  std::string name_;
  std::int64_t next_ns_ = INT64_MIN;
  Trail load_trail_;
  Trail reference_trail_;
};

}  // namespace sls::ros
