#include "tools/view/ros_face/newest_samples.hpp"

#include "common/bus/node.hpp"
#include "tools/view/live/vehicle_sample.hpp"

namespace sls::view {

NewestSamples::NewestSamples(const Parameters& parameters)
    : run_id_(parameters.run_id()), period_ns_(parameters.period_ns()) {
  for (const VehicleParameters& vehicle : parameters.vehicles())
    next_steps_[vehicle.vehicle_id()] = 0;
}

std::vector<ros::VehicleSample> NewestSamples::take(const std::deque<Bytes>& batches) {
  std::map<std::uint32_t, ros::VehicleSample> newest;
  RecordBatch batch;
  for (auto bytes = batches.rbegin(); bytes != batches.rend(); ++bytes) {
    if (newest.size() == next_steps_.size()) break;
    if (bus::decode(**bytes, batch) && batch.run_id() == run_id_) note(batch, newest);
  }
  std::vector<ros::VehicleSample> samples;
  for (const auto& [vehicle_id, sample] : newest) {
    next_steps_.at(vehicle_id) = sample.step + 1;
    samples.push_back(sample);
  }
  return samples;
}

void NewestSamples::note(const RecordBatch& batch,
                         std::map<std::uint32_t, ros::VehicleSample>& newest) const {
  for (auto entry = batch.entries().rbegin(); entry != batch.entries().rend(); ++entry) {
    const auto next = next_steps_.find(entry->vehicle_id());
    const bool is_news = next != next_steps_.end() && entry->step() >= next->second;
    if (is_news && entry->kind() != AnswerKind::ANSWER_LATE)  // a late answer has no state
      newest.emplace(
          entry->vehicle_id(),
          make_vehicle_sample(*entry, static_cast<std::int64_t>(entry->step()) * period_ns_));
  }
}

}  // namespace sls::view
