#pragma once

#include <nlohmann/json_fwd.hpp>

namespace sls::bench {

/// Measures for `seconds` how late a thread wakes up that sleeps until each multiple of `period_s`:
/// the bound of every real-time loop. Returns the same as Latencies::to_json.
nlohmann::json measure_timer(double period_s, double seconds);

}  // namespace sls::bench
