#include "bench/latencies.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

namespace sls::bench {

nlohmann::json Latencies::to_json() const {
  nlohmann::json json = {{"count", values_.size()}};
  if (values_.empty()) return json;
  auto sorted = values_;
  std::sort(sorted.begin(), sorted.end());
  const auto to_us = [](Duration value) { return static_cast<double>(value.count()) / 1e3; };
  const auto percentile = [&](double share) {
    const double rank = std::ceil(share * static_cast<double>(sorted.size()));  // counts from 1
    return to_us(sorted[static_cast<std::size_t>(rank) - 1]);
  };
  const Duration sum = std::accumulate(sorted.begin(), sorted.end(), Duration::zero());
  json["mean_us"] = to_us(sum) / static_cast<double>(sorted.size());
  json["min_us"] = to_us(sorted.front());
  json["p50_us"] = percentile(0.5);
  json["p99_us"] = percentile(0.99);
  json["p999_us"] = percentile(0.999);
  json["max_us"] = to_us(sorted.back());
  return json;
}

}  // namespace sls::bench
