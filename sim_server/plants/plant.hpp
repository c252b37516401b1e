/// A plant moves one or several vehicles under held forces. To add one: a folder beside this file
/// and a line in plants.def; README.md, "Adding a plant". No DDS here.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/config/model_keys.hpp"
#include "common/config/scenario.hpp"
#include "common/model/measurement.hpp"

namespace sls::sim {

/// A number that a plant publishes for each vehicle beyond position and velocity.
struct Signal {
  std::string name;  ///< column of state.csv, such as rotor_1_rad_s
  std::string unit;  ///< such as rad/s
};

/// A pure function of its parameters, its initial states and the sequence of calls: the same calls
/// give the same bits, however a sequence of steps is split into calls.
class Plant {
 public:
  virtual ~Plant() = default;

  /// Advances `steps` fixed steps of `plant.step_s` with the control force of each vehicle,
  /// `f_Q_W[vehicle]` (N, in W), held.
  /// @throws std::runtime_error naming the quantity and the step if a number is not finite;
  ///   `measurement` is then still that of an earlier step.
  virtual void advance(const std::vector<Eigen::Vector3d>& f_Q_W, std::int64_t steps) = 0;

  /// The truth after the last step; finite.
  virtual const model::Measurement& measurement(std::size_t vehicle) const = 0;

  /// Output of sensors and estimator after the last step. Only SensedPlant overrides this:
  /// make_plants() adds the scenario's `sensing` and `estimator` to every plant (sensing/).
  virtual const model::Measurement& seen(std::size_t vehicle) const { return measurement(vehicle); }

  /// True if `seen` always equals the truth at the end of a control period.
  virtual bool sees_truth() const { return true; }

  /// True if attitude and body rates have a meaning; false for point masses, which stay level.
  virtual bool has_attitude() const { return false; }

  /// The signals in every measurement, in their order; at most `model::kMaxNumbers`.
  virtual std::vector<Signal> signals() const { return {}; }

  /// Remarks for the user on a vehicle's flight since the last call: a few lines at most.
  virtual std::vector<std::string> take_remarks(std::size_t) { return {}; }
};

/// The inputs from which a plant is made.
struct PlantSetup {
  struct Vehicle {
    std::uint32_t id = 0;
    model::SlungLoadParameters parameters;
    config::InitialState initial;
    double thrust_scale = 1.0;  ///< that of `plant.thrust`, or its own
  };
  config::Plant plant;            ///< without `initial`, which each vehicle has
  config::Autopilot autopilot;    ///< for plants that use one
  std::filesystem::path folder;   ///< of the scenario file
  std::vector<Vehicle> vehicles;  ///< at least one, by ascending id
  bool lacks_thrust = false;      ///< a vehicle of the fleet gives another thrust than believed
  config::Estimator estimator;    ///< for an autopilot inside the plant, not for `seen`
};

enum class Moves {
  kOneVehicle,   ///< a plant for each vehicle: vehicles do not interact
  kAllVehicles,  ///< one plant for the whole fleet, which one server must fly
};

/// An entry of the registry.
struct PlantType {
  Moves moves = Moves::kOneVehicle;
  /// @throws config::ConfigError if the setup contradicts the plant.
  std::unique_ptr<Plant> (*make)(const PlantSetup& setup) = nullptr;
};

/// The type that `plant.model` names.
const PlantType& find_plant_type(const config::ModelName& model);

/// A plant and the vehicles of a list that it moves.
struct PlantOfVehicles {
  std::unique_ptr<Plant> plant;
  std::vector<std::size_t> vehicles;    ///< indices into the list
  std::vector<Eigen::Vector3d> forces;  ///< in this period; a member to avoid allocation
};

/// The plants of the vehicles `ids` (ascending) of `fleet`, with its `sensing` and `estimator`.
/// @throws config::ConfigError as `make`; also if a plant of all vehicles gets only some, or if the
///   name or unit of a signal is not allowed in a column.
std::vector<PlantOfVehicles> make_plants(const PlantType& type, const config::Scenario& fleet,
                                         const std::vector<std::uint32_t>& ids);

/// The plant of vehicle `id` alone, whose own scenario is `alone` (config::make_vehicle_scenario).
/// @throws config::ConfigError as `make_plants`.
std::unique_ptr<Plant> make_plant(const PlantType& type, const config::Scenario& alone,
                                  std::uint32_t id);

/// Names that a signal must not have: the other columns of state.csv, which the recorder lists.
const std::vector<std::string>& list_reserved_signal_names();

/// @throws std::runtime_error `QUANTITY is not finite after step N of the plant`; quantities are
/// named as the columns of state.csv.
void check_finite(const model::SlungLoadState& state, std::int64_t step);
void check_finite(const Eigen::Vector3d& v, std::int64_t step, const char* x, const char* y,
                  const char* z);
[[noreturn]] void throw_not_finite(const std::string& quantity, std::int64_t step);

}  // namespace sls::sim
