/// Takes the newest state of each vehicle from batches of sls/record; decodes only as many as
/// needed. No network here.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/ros/mirrors.hpp"

namespace sls::view {

using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;

class NewestSamples {
 public:
  /// For the run and the vehicles of `parameters`.
  explicit NewestSamples(const Parameters& parameters);

  /// The newest sample of each vehicle that has a newer one than at the last call, by ascending id.
  /// `batches`: samples of sls/record as they came, oldest first.
  std::vector<ros::VehicleSample> take(const std::deque<Bytes>& batches);

 private:
  void note(const RecordBatch& batch, std::map<std::uint32_t, ros::VehicleSample>& newest) const;

  std::uint64_t run_id_;
  std::int64_t period_ns_;
  std::map<std::uint32_t, std::uint64_t> next_steps_;  // by vehicle; older steps are ignored
};

}  // namespace sls::view
