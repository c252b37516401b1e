#include "tools/view/ros_face/newest_samples.hpp"

#include "common/bus/convert.hpp"
#include "common/bus/node.hpp"

namespace sls::view {
namespace {

ros::VehicleSample make_sample(const RecordEntry& entry, std::int64_t period_ns) {
  const model::Measurement truth = bus::to_measurement(entry.truth());
  ros::VehicleSample sample;
  sample.vehicle_id = entry.vehicle_id();
  sample.step = entry.step();
  sample.sim_time_ns = static_cast<std::int64_t>(entry.step()) * period_ns;
  sample.p_WQ = truth.p_WQ;
  sample.v_WQ = truth.v_WQ;
  sample.q_WB = truth.attitude.q_WB;
  sample.w_WB_B = truth.attitude.w_WB_B;
  sample.p_WL = truth.p_WL;
  sample.v_WL = truth.v_WL;
  sample.signals = entry.truth().signals();
  // The reference of an older answer belongs to an older step.
  if (entry.kind() == AnswerKind::ANSWER_ACCEPTED)
    sample.reference = bus::to_vector(entry.answer().reference().position_m());
  return sample;
}

}  // namespace

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
      newest.emplace(entry->vehicle_id(), make_sample(*entry, period_ns_));
  }
}

}  // namespace sls::view
