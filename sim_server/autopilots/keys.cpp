// The keys of every autopilot, for all programs.
#include "common/config/model_keys.hpp"

namespace sls {
namespace sim {

#define SLS_AUTOPILOT(name) const config::ModelKeys<config::Autopilot>& name##_keys();
#include "sim_server/autopilots/autopilots.def"
#undef SLS_AUTOPILOT

}  // namespace sim

const config::ModelRegistry<config::Autopilot>& config::autopilot_keys() {
  static const ModelRegistry<Autopilot> registry{
#define SLS_AUTOPILOT(name) {#name, &sim::name##_keys()},
#include "sim_server/autopilots/autopilots.def"
#undef SLS_AUTOPILOT
  };
  return registry;
}

}  // namespace sls
