#include <cmath>
#include <map>

#include "common/model/math.hpp"
#include "common/model/rotation.hpp"
#include "sim_server/autopilots/autopilot.hpp"

namespace sls::sim {

#define SLS_AUTOPILOT(name) std::unique_ptr<Autopilot> make_##name(const AutopilotSetup& setup);
#include "sim_server/autopilots/autopilots.def"
#undef SLS_AUTOPILOT
std::unique_ptr<Autopilot> make_shared_library_autopilot(const AutopilotSetup& setup);

std::unique_ptr<Autopilot> make_autopilot(const AutopilotSetup& setup) {
  using Make = std::unique_ptr<Autopilot> (*)(const AutopilotSetup&);
  static const std::map<std::string, Make> registry{
#define SLS_AUTOPILOT(name) {#name, make_##name},
#include "sim_server/autopilots/autopilots.def"
#undef SLS_AUTOPILOT
  };
  const config::ModelName& model = setup.autopilot.model;
  if (model.is_shared_library()) return make_shared_library_autopilot(setup);
  const auto found = registry.find(model.name);
  if (found == registry.end())
    throw config::ConfigError("autopilot.model: expected " + config::list_models(registry) +
                              ", got " + model.name);
  return found->second(setup);
}

Eigen::Quaterniond calc_attitude_for(const Eigen::Vector3d& f_W, double yaw) {
  // The force in the frame of the heading: roll and pitch do not depend on the yaw.
  const Eigen::Vector3d f = model::make_turn(-yaw, Eigen::Vector3d::UnitZ()) * f_W.normalized();
  const double roll = math::asin(std::max(-1.0, std::min(1.0, f.y())));
  const double pitch = math::atan2(-f.x(), -f.z());
  return model::make_attitude(roll, pitch, yaw);
}

Eigen::VectorXd calc_equal_speeds(const std::vector<Rotor>& rotors, double thrust) {
  Eigen::VectorXd speeds(rotors.size());
  const double share = std::max(thrust, 0.0) / static_cast<double>(rotors.size());
  for (std::size_t i = 0; i < rotors.size(); ++i)
    speeds[i] = std::sqrt(share / rotors[i].thrust_constant);
  return speeds;
}

}  // namespace sls::sim
