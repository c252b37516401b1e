#include "sim_server/core/report/status_series.hpp"

#include <algorithm>
#include <string>

namespace sls::sim {
namespace {

/// `text` as sls/status can hold it: a longer one ends with "...", between two letters of UTF-8.
std::string fit(const std::string& text) {
  constexpr std::size_t kMost = 255;  // bytes, idl/sls.idl
  if (text.size() <= kMost) return text;
  std::size_t end = kMost - 3;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0u) == 0x80u) --end;
  return text.substr(0, end) + "...";
}

}  // namespace

void RoundTrips::add(Duration round_trip) {
  values_[next_] = round_trip;
  next_ = (next_ + 1) % kCapacity;
  count_ = std::min(count_ + 1, kCapacity);
}

RoundTrips::Duration RoundTrips::calc_percentile(int percent) const {
  if (count_ == 0) return Duration::zero();
  auto sorted = values_;  // values_[0 … count_) are valid and unsorted
  const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(count_);
  const auto share = static_cast<std::size_t>(std::clamp(percent, 1, 100));
  const std::size_t rank = (share * count_ + 99) / 100;  // from 1, rounded up
  const auto wanted = sorted.begin() + static_cast<std::ptrdiff_t>(rank - 1);
  std::nth_element(sorted.begin(), wanted, end);
  return *wanted;
}

SimStatus StatusSeries::make(const Content& content, sync::Time now) {
  made_ = now;
  SyncCounters counters = content.counters;
  timing.fill(counters);
  const double wall_s = calc_wall_s(now);
  const double simulated_s = static_cast<double>(content.step) * period_ns_ * 1e-9;
  SimStatus sample;
  sample.run_id(run_id_);
  sample.vehicle_id(vehicle_id_);
  sample.sample_index(size_++);
  sample.phase(content.phase);
  sample.reason(fit(content.reason));
  sample.step(content.step);
  sample.controller_name(content.controller_name);
  sample.real_time_factor(wall_s > 0.0 ? simulated_s / wall_s : 0.0);
  sample.round_trip_p50_ns(static_cast<std::uint64_t>(round_trips.calc_percentile(50).count()));
  sample.round_trip_p99_ns(static_cast<std::uint64_t>(round_trips.calc_percentile(99).count()));
  sample.timing(timing.label());
  sample.problem(fit(content.problem));
  sample.counters(counters);
  return sample;
}

}  // namespace sls::sim
