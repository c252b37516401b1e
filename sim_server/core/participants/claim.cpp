#include "sim_server/core/participants/claim.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace sls::sim {

std::string describe_rival(const std::vector<sync::Run>& others, std::uint64_t run_id,
                           const std::vector<std::uint32_t>& vehicle_ids, int progress) {
  for (const sync::Run& other : others) {
    const int others_progress = sync::calc_progress(other.status);  // negative after its end
    const auto shared = std::find_if(vehicle_ids.begin(), vehicle_ids.end(), [&](std::uint32_t id) {
      return sync::serves_vehicle(other.parameters, id);
    });
    if (shared == vehicle_ids.end()) continue;
    if (others_progress > progress ||
        (others_progress == progress && other.parameters.run_id() < run_id))
      return fmt::format(
          "vehicle {}: expected no other server on this domain, got one (run {:016x})", *shared,
          other.parameters.run_id());
  }
  return "";
}

}  // namespace sls::sim
