/// Additions of a plant, an autopilot or a control law to the scenario file: keys of its own in the
/// section that names it. Each folder of sim_server/plants, sim_server/autopilots and
/// control_client/laws describes them in its keys.hpp, without Simbody or DDS; common/models
/// registers them. How to describe keys: own_keys.hpp.
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"

namespace sls::config {

class KeyLister;
class KeyNames;
class MapReader;
class MapWriter;
class Places;

/// A vehicle as pictures show it, in the frame B of its body.
struct VehicleShape {
  struct Rotor {
    Eigen::Vector3d position;  ///< m
    int spin;                  ///< as in the scenario: 1 counter-clockwise, −1 clockwise
  };
  Eigen::Vector3d attachment = Eigen::Vector3d::Zero();  ///< of the pendulum, m
  std::vector<Rotor> rotors;                             ///< none: a point mass
};

/// The keys of one model. `Section` is the section that has them: Plant, Autopilot or Controller.
template <class Section>
class ModelKeys {
 public:
  virtual ~ModelKeys() = default;
  virtual void describe(KeyLister& map, Section& section) const = 0;
  virtual void describe(KeyNames& map, Section& section) const = 0;
  virtual void describe(MapReader& map, Section& section) const = 0;
  virtual void describe(MapWriter& map, Section& section) const = 0;
  /// Rules between these keys and others of the scenario. @throws ConfigError.
  virtual void check(const Scenario&, const Places&) const {}
  /// What the keys allow but hardly mean. Called after `check`.
  virtual std::optional<ConfigError> find_warning(const Scenario&, const Places&) const {
    return {};
  }
  /// True for a plant whose vehicles have an attitude. The scenario may then have an initial
  /// attitude and attitude errors (`estimator`); a plant of the project also accepts an
  /// `autopilot`.
  virtual bool has_attitude(const Section&) const { return false; }
  /// The key with which they have one, of a plant whose vehicles can also be point masses.
  virtual std::string find_attitude_key() const { return ""; }
  /// The shape of the vehicles of a plant.
  virtual VehicleShape calc_shape(const Section&) const { return {}; }
  /// Bound of the fastest swing of vehicle `id` near hover in a plant (its README.md), rad/s.
  virtual double calc_swing_rate(const Scenario& scenario, std::uint32_t id) const {
    const model::SlungLoadParameters vehicle = make_vehicle_scenario(scenario, id).vehicle;
    return std::sqrt(vehicle.total_mass() * vehicle.gravity /
                     (vehicle.quad_mass * vehicle.rod_length));
  }
  /// Bound of the fastest oscillation or decay of springs and dampers in a plant, 1/s.
  virtual double calc_spring_rate(const Scenario&) const { return 0.0; }
  /// The one load of a plant whose vehicles carry it together. Called after `check`.
  virtual std::optional<model::SharedLoad> calc_shared_load(const Scenario&) const { return {}; }
};

/// The keys of each model, by name.
template <class Section>
using ModelRegistry = std::map<std::string, const ModelKeys<Section>*>;

/// The models that a scenario may name.
struct Models {
  ModelRegistry<Plant> plants;
  ModelRegistry<Autopilot> autopilots;
  ModelRegistry<Controller> laws;
};

/// "pid, qsf or a shared library (a path ending in .so)". A registry maps names to anything.
template <class Registry>
std::string list_models(const Registry& registry) {
  std::string names;
  for (const auto& item : registry) names += (names.empty() ? "" : ", ") + item.first;
  return names + " or a shared library (a path ending in .so)";
}

/// The keys of `model`: of the registry, or those of any shared library.
template <class Section>
const ModelKeys<Section>& find_model_keys(const ModelRegistry<Section>& registry,
                                          const ModelName& model);

}  // namespace sls::config
