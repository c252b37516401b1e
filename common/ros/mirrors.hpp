/// Standard ROS 2 messages that mirror a flight. Foxglove, MCAP readers and ROS tools draw them
/// without code of this project. Frames as in REP-103 and REP-105: README.md. No network here.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/scene/load_scene.hpp"

namespace sls::ros {

/// A topic of mirrors.
struct Channel {
  std::string topic;      ///< "/tf"
  std::string type;       ///< "tf2_msgs/msg/TFMessage"
  std::string schema;     ///< ros2msg: definition, then those of its parts after "===" lines
  std::string type_hash;  ///< "RIHS01_…"
  bool is_latched = false;
};

/// One step of one vehicle, in frame W (z down) and the vehicle's body frame (z down).
struct VehicleSample {
  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;
  std::int64_t sim_time_ns = 0;
  Eigen::Vector3d p_WQ = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_WQ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_WL = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_WL = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> reference;  ///< desired position of the load
  std::vector<double> signals;               ///< of the plant; read for a load on cables
};

/// Makes the messages of a run's vehicles; remembers their trails.
class Mirrors {
 public:
  /// `vehicle_ids` must be in ascending order. `scene`: the one load of vehicles that carry it by
  /// cables; none: each has its own load on a rod.
  explicit Mirrors(const std::vector<std::uint32_t>& vehicle_ids,
                   std::optional<scene::LoadScene> scene = {});
  ~Mirrors();

  const std::vector<Channel>& channels() const;

  /// `emit(channel, sim_time_ns, cdr)`: index into `channels()`; plain CDR, little-endian, with its
  /// encapsulation header; valid during the call.
  using Emit = std::function<void(std::size_t channel, std::int64_t sim_time_ns,
                                  const std::vector<std::uint8_t>& cdr)>;

  /// The messages written once: /tf_static. Call first.
  void emit_static(const Emit& emit);
  /// All messages of one sample: /clock (of a step once), /tf, odometry and poses of quadrotor and
  /// load; markers at most every 50 ms of simulation time. The markers of a load on cables are with
  /// those of the first vehicle.
  /// Samples of a vehicle must come in step order; the caller may leave out any of them.
  void emit(const VehicleSample& sample, const Emit& emit);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sls::ros
