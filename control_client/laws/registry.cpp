#include <map>

#include "common/config/model_keys.hpp"
#include "control_client/laws/control_law.hpp"

namespace sls::control {

#define SLS_LAW(name) std::unique_ptr<const ControlLaw> make_##name##_law(const LawSetup&);
#include "control_client/laws/laws.def"
#undef SLS_LAW
std::unique_ptr<const ControlLaw> make_shared_library_law(const LawSetup&);

std::unique_ptr<const ControlLaw> make_control_law(const LawSetup& setup) {
  using Maker = std::unique_ptr<const ControlLaw> (*)(const LawSetup&);
  static const std::map<std::string, Maker> registry{
#define SLS_LAW(name) {#name, &make_##name##_law},
#include "control_client/laws/laws.def"
#undef SLS_LAW
  };
  const config::ModelName& law = setup.controller.law;
  if (law.is_shared_library()) return make_shared_library_law(setup);
  const auto found = registry.find(law.name);
  if (found == registry.end())
    throw config::ConfigError("controller.law: expected " + config::list_models(registry) +
                              ", got " + law.name);
  return found->second(setup);
}

}  // namespace sls::control
