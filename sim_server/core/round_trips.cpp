#include "sim_server/core/round_trips.hpp"

#include <algorithm>

namespace sls::sim {

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

}  // namespace sls::sim
