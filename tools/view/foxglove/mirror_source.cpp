#include "tools/view/foxglove/mirror_source.hpp"

#include <algorithm>

#include "tools/view/foxglove/sample_stamp.hpp"
#include "tools/view/live/vehicle_sample.hpp"

namespace sls::view::foxglove {

namespace {

constexpr auto kSpacing = std::chrono::milliseconds(10);
constexpr std::int64_t kMostAtOnce = 4;

/// Entries that hold a state; late answers come without one.
bool has_state(const RecordEntry& entry) { return entry.kind() != AnswerKind::ANSWER_LATE; }

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
  for (const std::size_t i : chosen) {
    const RecordEntry& entry = batch.entries()[i];
    mirrors_.emit(make_vehicle_sample(entry, calc_sim_time(entry.step(), period_ns_)),
                  emit_message);
  }
}

}  // namespace sls::view::foxglove
