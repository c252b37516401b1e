#include "tools/view/foxglove/mirror_source.hpp"

#include <algorithm>

#include "common/bus/convert.hpp"
#include "tools/view/foxglove/sample_stamp.hpp"

namespace sls::view::foxglove {

namespace {

constexpr auto kSpacing = std::chrono::milliseconds(10);
constexpr std::int64_t kMostAtOnce = 4;

/// Entries that hold a state; late answers come without one.
bool has_state(const RecordEntry& entry) { return entry.kind() != AnswerKind::ANSWER_LATE; }

/// Only an accepted answer has the desired position of the load at the entry's step.
bool has_reference(const RecordEntry& entry) { return entry.kind() == AnswerKind::ANSWER_ACCEPTED; }

}  // namespace

MirrorSource::MirrorSource(const std::vector<std::uint32_t>& vehicle_ids,
                           const Parameters& parameters)
    : period_ns_(parameters.period_ns()),
      mirrors_(vehicle_ids, scene::read_load_scene(parameters)) {
  for (const std::uint32_t id : vehicle_ids) vehicles_[id] = {};
}

bool MirrorSource::is_due(Time now) const {
  return std::any_of(vehicles_.begin(), vehicles_.end(), [now](const auto& vehicle) {
    return now - vehicle.second.paid_until >= kSpacing;
  });
}

void MirrorSource::note(const RecordBatch& batch, Time now,
                        const ros::Mirrors::Emit& emit_message) {
  std::map<std::uint32_t, std::vector<std::size_t>> steps;  // of each vehicle, in order
  for (std::size_t i = 0; i < batch.entries().size(); ++i) {
    const RecordEntry& entry = batch.entries()[i];
    const auto vehicle = vehicles_.find(entry.vehicle_id());
    if (vehicle == vehicles_.end() || !has_state(entry)) continue;
    if (entry.step() < vehicle->second.next_step) continue;
    vehicle->second.next_step = entry.step() + 1;
    steps[entry.vehicle_id()].push_back(i);
  }
  std::vector<std::size_t> chosen;
  for (const auto& [id, indices] : steps) {
    Vehicle& vehicle = vehicles_[id];
    vehicle.paid_until = std::max(vehicle.paid_until, now - kMostAtOnce * kSpacing);
    const auto due = static_cast<std::size_t>((now - vehicle.paid_until) / kSpacing);
    const std::size_t count = std::min(due, indices.size());
    for (std::size_t i = 1; i <= count; ++i)
      chosen.push_back(indices[i * indices.size() / count - 1]);
    vehicle.paid_until += static_cast<std::int64_t>(count) * kSpacing;
  }
  std::sort(chosen.begin(), chosen.end());  // by step, so that the clock never goes back
  for (const std::size_t i : chosen) emit(batch.entries()[i], emit_message);
}

void MirrorSource::emit(const RecordEntry& entry, const ros::Mirrors::Emit& emit_message) {
  const PlantState& truth = entry.truth();
  const std::array<double, 4>& q_WB = truth.q_WB();
  ros::VehicleSample sample;
  sample.vehicle_id = entry.vehicle_id();
  sample.step = entry.step();
  sample.sim_time_ns = calc_sim_time(entry.step(), period_ns_);
  sample.p_WQ = bus::to_vector(truth.p_WQ_m());
  sample.v_WQ = bus::to_vector(truth.v_WQ_m_s());
  sample.q_WB = Eigen::Quaterniond(q_WB[0], q_WB[1], q_WB[2], q_WB[3]);
  sample.w_WB_B = bus::to_vector(truth.w_WB_B_rad_s());
  sample.p_WL = bus::to_vector(truth.p_WL_m());
  sample.v_WL = bus::to_vector(truth.v_WL_m_s());
  sample.signals = truth.signals();
  if (has_reference(entry))
    sample.reference = bus::to_vector(entry.answer().reference().position_m());
  mirrors_.emit(sample, emit_message);
}

}  // namespace sls::view::foxglove
