#pragma once

#include <chrono>
#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace sls::bench {

/// Single durations and their statistics.
class Latencies {
 public:
  using Duration = std::chrono::nanoseconds;

  void reserve(std::size_t count) { values_.reserve(count); }
  void add(Duration value) { values_.push_back(value); }
  std::size_t count() const { return values_.size(); }

  /// count, mean_us, min_us, p50_us, p99_us, p999_us and max_us (nearest rank). Without a duration
  /// only count.
  nlohmann::json to_json() const;

 private:
  std::vector<Duration> values_;
};

}  // namespace sls::bench
