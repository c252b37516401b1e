/// The mirrors of common/ros from batches of sls/record, thinned to a rate for display.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/ros/mirrors.hpp"

namespace sls::view::foxglove {

class MirrorSource {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `vehicle_ids`: those of `parameters`, ascending.
  MirrorSource(const std::vector<std::uint32_t>& vehicle_ids, const Parameters& parameters);

  const std::vector<ros::Channel>& channels() const { return mirrors_.channels(); }
  /// Call it first.
  void emit_static(const ros::Mirrors::Emit& emit) { mirrors_.emit_static(emit); }

  /// True if the next sample of a vehicle is due: at most 100 per second of wall time for each
  /// vehicle, at most 4 at once from a late batch. Most batches of a fast flight are therefore not
  /// decoded.
  bool is_due(Time now) const;
  /// Emits the due samples of `batch`, evenly spaced, always including the newest.
  void note(const RecordBatch& batch, Time now, const ros::Mirrors::Emit& emit);

 private:
  struct Vehicle {
    Time paid_until{};  ///< samples up to this time have been emitted
    std::uint64_t next_step = 0;
  };

  const std::int64_t period_ns_;
  ros::Mirrors mirrors_;
  std::map<std::uint32_t, Vehicle> vehicles_;
};

}  // namespace sls::view::foxglove
