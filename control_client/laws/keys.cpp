// The keys of every control law, for all programs.
#include "common/config/model_keys.hpp"

namespace sls {
namespace control {

#define SLS_LAW(name) const config::ModelKeys<config::Controller>& name##_keys();
#include "control_client/laws/laws.def"
#undef SLS_LAW

}  // namespace control

const config::ModelRegistry<config::Controller>& config::law_keys() {
  static const ModelRegistry<Controller> registry{
#define SLS_LAW(name) {#name, &control::name##_keys()},
#include "control_client/laws/laws.def"
#undef SLS_LAW
  };
  return registry;
}

}  // namespace sls
