// The keys of every plant: without Simbody, for all programs.
#include "common/config/model_keys.hpp"

namespace sls {
namespace sim {

#define SLS_PLANT(name) const config::ModelKeys<config::Plant>& name##_keys();
#include "sim_server/plants/plants.def"
#undef SLS_PLANT

}  // namespace sim

const config::ModelRegistry<config::Plant>& config::plant_keys() {
  static const ModelRegistry<Plant> registry{
#define SLS_PLANT(name) {#name, &sim::name##_keys()},
#include "sim_server/plants/plants.def"
#undef SLS_PLANT
  };
  return registry;
}

}  // namespace sls
