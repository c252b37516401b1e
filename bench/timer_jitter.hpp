#pragma once

#include <nlohmann/json_fwd.hpp>

namespace sls::bench {

/// How late a thread wakes that sleeps until each multiple of `period_s`, for `seconds`: the bound
/// of a real-time loop that does nothing. As Latencies.
nlohmann::json measure_timer(double period_s, double seconds);

}  // namespace sls::bench
