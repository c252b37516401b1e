#pragma once

#include <array>
#include <chrono>
#include <cstddef>

namespace sls::sim {

/// The last 1,000 round trips. `add` is cheap; a percentile reads all of them.
class RoundTrips {
 public:
  using Duration = std::chrono::nanoseconds;

  static constexpr std::size_t kCapacity = 1000;

  void add(Duration round_trip);

  /// The smallest round trip that `percent` % (1 to 100) of those held do not exceed (nearest
  /// rank); zero before the first.
  Duration calc_percentile(int percent) const;

 private:
  std::array<Duration, kCapacity> values_{};
  std::size_t count_ = 0;  // held, at most kCapacity
  std::size_t next_ = 0;   // index of the next one
};

}  // namespace sls::sim
