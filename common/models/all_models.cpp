// The keys of every plant, autopilot and law of the project: without Simbody, for all programs.
#include "common/config/model_keys.hpp"

namespace sls {

#define SLS_PLANT(name) const config::ModelKeys<config::Plant>& name##_keys();
#define SLS_AUTOPILOT(name) const config::ModelKeys<config::Autopilot>& name##_keys();
#define SLS_LAW(name) const config::ModelKeys<config::Controller>& name##_keys();
namespace sim {
#include "sim_server/autopilots/autopilots.def"
#include "sim_server/plants/plants.def"
}  // namespace sim
namespace control {
#include "control_client/laws/laws.def"
}  // namespace control
#undef SLS_PLANT
#undef SLS_AUTOPILOT
#undef SLS_LAW

#define SLS_PLANT(name) {#name, &sim::name##_keys()},
#define SLS_AUTOPILOT(name) {#name, &sim::name##_keys()},
#define SLS_LAW(name) {#name, &control::name##_keys()},
const config::Models& config::all_models() {
  static const Models models{
      {
#include "sim_server/plants/plants.def"
      },
      {
#include "sim_server/autopilots/autopilots.def"
      },
      {
#include "control_client/laws/laws.def"
      },
  };
  return models;
}
#undef SLS_PLANT
#undef SLS_AUTOPILOT
#undef SLS_LAW

}  // namespace sls
