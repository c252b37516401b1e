/// A scenario: everything that decides a run. Read from one YAML file; docs/reference/scenario.md
/// lists its keys. Programs and tests share these plain structs; all values are SI, times whole
/// nanoseconds.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <any>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "common/config/config_error.hpp"
#include "common/model/offset.hpp"
#include "common/model/parameters.hpp"
#include "common/model/shared_load.hpp"
#include "common/model/state.hpp"

namespace sls::config {

/// Bound of the string in `sls/parameters` that carries the whole scenario.
inline constexpr std::size_t kMaxScenarioBytes = 32768;

/// Bound of the vehicle ids in `sls/parameters`.
inline constexpr std::size_t kMaxVehicles = 256;

// --- models ------------------------------------------------------------------------------------

/// A plant, a control law or an autopilot, as the file names it.
struct ModelName {
  std::string name;   ///< of the registry, or the path of a shared library
  std::string place;  ///< FILE:LINE of the key, for messages; empty: not in the file

  bool is_shared_library() const;  ///< ends with ".so"
  /// Path of the shared library, which the file names relative to `folder`; empty for a registered
  /// name.
  std::filesystem::path find_library(const std::filesystem::path& folder) const;
  /// FILE:LINE: `key`.
  std::string describe_place(const std::string& key) const {
    return place.empty() ? key : place + ": " + key;
  }
};

/// The values of the keys that only the named model has. The model's folder defines their type.
class OwnValues {
 public:
  OwnValues() = default;
  template <class Values, class = std::enable_if_t<!std::is_same_v<Values, OwnValues>>>
  OwnValues(Values values) : any_(std::move(values)) {}

  /// The values held, or the defaults of `Values` if another type is held.
  template <class Values>
  const Values& get() const {
    static const Values kDefaults{};
    const auto* held = std::any_cast<Values>(&any_);
    return held ? *held : kDefaults;
  }
  /// The same values, to be changed.
  template <class Values>
  Values& edit() {
    if (!std::any_cast<Values>(&any_)) any_ = Values{};
    return std::any_cast<Values&>(any_);
  }

 private:
  std::any any_;
};

/// Own values of a model in a shared library: any map, as JSON.
struct LibraryParameters {
  std::string json = "{}";
  std::string place;  ///< FILE:LINE of the key; empty: not in the file

  /// FILE:LINE: KEY of these parameters in `section`, or of the library where there are none.
  std::string describe_place(const ModelName& library, const std::string& section) const {
    return place.empty() ? library.describe_place(section) : place + ": " + section + ".parameters";
  }
};

// --- fleet -------------------------------------------------------------------------------------

/// How one vehicle of a fleet differs from `vehicle`, `plant.initial` and `mission`.
struct VehicleVariant {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< of initial and reference positions, m
  std::optional<double> quad_mass;                   ///< kg; none: that of `vehicle`
  std::optional<double> load_mass;                   ///< kg
  std::optional<double> rod_length;                  ///< m
  std::optional<double> thrust_scale;                ///< none: that of `plant.thrust`
  std::optional<Eigen::Vector3d> v_WQ;               ///< at step 0, m/s
  std::optional<Eigen::Quaterniond> q_WB;            ///< at step 0
  std::optional<Eigen::Vector3d> w_WB_B;             ///< at step 0, rad/s
};

// --- plant -------------------------------------------------------------------------------------

enum class Body { kQuadrotor, kLoad };

/// State of the bodies at step 0. The file has the position of one body; the rod angles give that
/// of the other.
struct InitialState {
  Body placed = Body::kLoad;                           ///< `load_position_m` or `quad_position_m`
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the placed body, m
  Eigen::Vector3d v_WQ = Eigen::Vector3d::Zero();      ///< quadrotor velocity, m/s
  bool has_own_velocity = false;  ///< of the one vehicle, not of all: not a key
  model::RodAngles rod;
  std::optional<Eigen::Quaterniond> q_WB;  ///< of plants whose vehicles turn; none: level
  std::optional<Eigen::Vector3d> w_WB_B;   ///< the same, rad/s; none: at rest
};

/// A change of the wind: it comes within `rise`, stays, and goes within `rise`.
struct Gust {
  std::int64_t at_ns = 0;
  std::int64_t rise_ns = 0;
  std::optional<std::int64_t> for_ns;                  ///< until it begins to go; none: stays
  Eigen::Vector3d v_wind_W = Eigen::Vector3d::Zero();  ///< that it adds, m/s
};

/// Dryden turbulence at low altitude, MIL-F-8785C, carried by the mean wind.
struct Turbulence {
  static constexpr double kReach = 500.0;  ///< from the origin, along the wind, m

  double altitude = 10.0;  ///< above the ground, m, 3 to 300
  double w20 = 0.0;        ///< wind at 20 ft (6.096 m), which sets the intensity, m/s
  std::uint64_t seed = 0;
};

/// What changes the wind of `Plant::air`.
struct Wind {
  std::vector<Gust> gusts;
  std::optional<Turbulence> turbulence;

  bool varies() const { return !gusts.empty() || turbulence; }
};

/// The voltage that turns the rotors of a vehicle.
struct Battery {
  double full_v = 0.0;          ///< open-circuit voltage, charged: that of the thrust constants
  double empty_v = 0.0;         ///< the same, discharged
  double resistance_ohm = 0.0;  ///< internal
  double capacity_ah = 0.0;
  double hover_power_w = 0.0;  ///< of a vehicle that carries its share of the load
};

/// From a time on a rotor, or a point mass as a whole, gives another share of its thrust.
struct ThrustFailure {
  std::int64_t at_ns = 0;
  int vehicle = 0;
  std::optional<int> rotor;  ///< from 1
  double scale = 0.0;
};

/// True thrust per believed thrust.
struct Thrust {
  double scale = 1.0;
  double drift = 0.0;  ///< of the scale, relative, 1/s
  std::optional<Battery> battery;
  std::vector<ThrustFailure> failures;
};

struct Plant {
  ModelName model{"slung_load", ""};
  OwnValues own;
  std::int64_t step_ns = 1'000'000;  ///< integration step
  InitialState initial;
  model::Aerodynamics air;  ///< true drag and mean wind
  Wind wind;
  model::LoadDrag load_drag;
  Thrust thrust;
  Eigen::Vector3d disturbance_W = Eigen::Vector3d::Zero();  ///< d, constant, on the quadrotor, N
};

/// The autopilot inside the plant: turns the controller's force into rotor speeds.
struct Autopilot {
  ModelName model{"none", ""};
  OwnValues own;
  std::int64_t period_ns = 0;  ///< a multiple of the plant's step; 0: every step
};

// --- synchronisation ---------------------------------------------------------------------------

enum class SyncMode { kLockstep, kRealtime };

/// Participants that must be ready before step 0.
struct WaitFor {
  int controllers = 1;  ///< for each vehicle
  int recorders = 1;
  double timeout_s = 30.0;
};

/// Reaction of the server to a vehicle whose controllers stay silent in flight.
enum class ControllerPolicy {
  kWait,      ///< lockstep: keeps waiting
  kHold,      ///< flies on with the last answer, after `max_hold_s` with the fail-safe force
  kFailsafe,  ///< flies on with the fail-safe force
  kStop,      ///< ends the run as failed
};

/// Reaction of the server to an expected recorder that is gone or too far behind.
enum class RecorderPolicy {
  kWait,  ///< lockstep: keeps waiting
  kGoOn,  ///< flies on without it; its recording will have a gap
  kStop,  ///< ends the run as failed
};

/// Time limits for a participant that is silent or gone. Every policy reports it within 1 s and
/// then every 5 s.
template <class Policy>
struct Absence {
  Policy policy = Policy::kWait;
  /// Time limit, after which the run fails (`wait`) or the policy acts (all others).
  double deadline_s = 30.0;
};

struct WaitPolicies {
  Absence<ControllerPolicy> controller;
  Absence<RecorderPolicy> recorder;
  double server_deadline_s = 30.0;  ///< after which clients and recorders give up a silent server
};

struct Sync {
  SyncMode mode = SyncMode::kLockstep;
  std::int64_t period_ns = 4'000'000;  ///< control period, a multiple of the plant's step
  double real_time_factor = 1.0;       ///< of `realtime`
  double take_over_s = 0.1;            ///< silence after which the next-strongest client answers
  double max_hold_s = 0.5;             ///< simulated time a force is held before the fail-safe
  WaitFor wait_for;
  WaitPolicies wait;

  /// Silence of a vehicle's controllers after which the server ends the run.
  double calc_controller_patience_s() const {
    const Absence<ControllerPolicy>& absence = wait.controller;
    const bool flies_on =
        absence.policy == ControllerPolicy::kHold || absence.policy == ControllerPolicy::kFailsafe;
    return flies_on ? std::max(absence.deadline_s, wait_for.timeout_s) : absence.deadline_s;
  }
};

// --- sensing -----------------------------------------------------------------------------------

/// Sampling period of a group of sensors, and age of its samples.
struct SampleTimes {
  std::int64_t period_ns = 0;  ///< samples at its multiples from time 0; 0: at every plant step
  std::int64_t age_ns = 0;     ///< controllers receive each sample this much later
};

/// Delays of the measurements and of the answers.
struct Sensing {
  SampleTimes body;                ///< position, velocity, attitude, body rates, signals
  SampleTimes rod;                 ///< the rod's angles and rates
  std::int64_t node_delay_ns = 0;  ///< from an answer to the plant
};

/// Constant errors of the measured state.
struct Estimator {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of quadrotor and load alike, m
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< of quadrotor and load alike, m/s
  model::AttitudeError attitude;                       ///< of plants that have one
};

// --- faults ------------------------------------------------------------------------------------

/// Where a fault acts.
enum class FaultChannel {
  kState,    ///< between plant and controllers: what they measure
  kCommand,  ///< between controllers and plant: the force that acts
};

/// The sample of a channel arrives `by_ns` later.
struct DelayFault {
  std::int64_t by_ns = 0;  ///< a multiple of the control period
};

/// A sample is lost with this probability; the receiver keeps the last one that arrived.
struct DropFault {
  double probability = 0.0;
  std::uint64_t seed = 0;
};

/// The receiver keeps the last sample that arrived before the fault.
struct FreezeFault {};

/// With this probability a sample arrives one period later, after its successor. The receiver then
/// uses it until the next sample arrives.
struct ReorderFault {
  double probability = 0.0;
  std::uint64_t seed = 0;
};

/// Numbers added to a sample. `state`: all but `force`; `command`: `force` alone.
struct SampleOffset : model::StateOffset {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N
};

struct BiasFault {
  SampleOffset offset;
};

/// Normally distributed, independent from step to step.
struct NoiseFault {
  SampleOffset deviation;  ///< standard deviations, ≥ 0
  std::uint64_t seed = 0;
};

using FaultEffect =
    std::variant<DelayFault, DropFault, FreezeFault, ReorderFault, BiasFault, NoiseFault>;

/// A disturbance in simulation time: for steps whose time is in [from, to).
struct Fault {
  std::string kind;  ///< the YAML key: delay, drop, freeze, reorder, bias, noise
  FaultEffect effect;
  FaultChannel on = FaultChannel::kState;
  int vehicle = 0;  ///< its id in the fleet
  std::int64_t from_ns = 0;
  std::int64_t to_ns = 1'000'000'000'000'000;  ///< default: to the end
};

// --- controller --------------------------------------------------------------------------------

enum class StateWiring {
  kCorrect,
  kGazeboPlugin,  ///< the published plugin's permuted angle slots
};

/// Vehicle parameters that the controller uses; those not in the file equal the plant's.
struct ControllerModel {
  /// Numbers that the file leaves out: in a fleet they equal the true ones of each vehicle.
  struct Follows {
    bool quad_mass = false;
    bool load_mass = false;
    bool rod_length = false;
  };

  model::SlungLoadParameters vehicle;
  model::Aerodynamics air;
  Follows follows;
};

struct Controller {
  ModelName law{"qsf", ""};
  OwnValues own;
  double force_limit_n = 200.0;  ///< commands beyond are refused by the server
  bool saturate = false;         ///< the client scales the force to the limit
  bool drag_feed_forward = false;
  StateWiring state_wiring = StateWiring::kCorrect;
  ControllerModel model;
};

// --- mission -----------------------------------------------------------------------------------

/// Roll, pitch, yaw (rad) of a rigid load that several vehicles carry; none: as at step 0. The load
/// is turned by yaw about z, then by pitch about its y, then by roll about its x.
using StageAttitude = std::optional<Eigen::Vector3d>;

/// Constant reference: the stages `hold` and `set_point`.
struct ConstantReference {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m
  StageAttitude attitude = {};
};

/// offset + (a_x sin 2πt/T, a_y sin 4πt/T, a_z sin 2πt/T).
struct FigureEightReference {
  Eigen::Vector3d amplitude = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();     ///< m
  double period_s = 16.0;                               ///< T of one lap, s
  StageAttitude attitude = {};
};

/// Ninth-degree polynomial from rest to rest in `duration_s`, then constant.
struct RestToRestReference {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d to = Eigen::Vector3d::Zero();    ///< m
  double duration_s = 1.0;
  StageAttitude from_attitude = {};
  StageAttitude to_attitude = {};
};

using StageReference = std::variant<ConstantReference, FigureEightReference, RestToRestReference>;

/// The stage ends at the first step that is `duration` after its start.
struct LeaveAfter {
  std::int64_t duration_ns = 0;
};

enum class CableState { kTaut, kSlack };
enum class LoadPlace { kOnGround, kOffGround };

/// The stage ends at the first step later than `after` at which its condition holds; the mission
/// fails if that has not happened by `timeout`.
struct LeaveUntil {
  enum class Condition { kWithin, kCable, kLoad, kTensionAbove, kTensionBelow };

  Condition condition = Condition::kWithin;
  std::int64_t after_ns = 0;
  /// kWithin: the body is within the radius of the reference position plus `offset`.
  double radius_m = 0.2;
  Body body = Body::kLoad;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< m
  CableState cable = CableState::kTaut;              ///< kCable: state of the own cable
  LoadPlace load = LoadPlace::kOnGround;             ///< kLoad
  double tension_n = 0.0;  ///< kTensionAbove, kTensionBelow: that of the own cable
  std::int64_t timeout_ns = 0;
};

using LeaveCondition = std::variant<LeaveAfter, LeaveUntil>;

/// Least duration of a stage, ns.
inline std::int64_t find_least_duration_ns(const LeaveCondition& leave) {
  const auto* timed = std::get_if<LeaveAfter>(&leave);
  return timed ? timed->duration_ns : std::get<LeaveUntil>(leave).after_ns;
}

struct Stage {
  std::string kind;  ///< the YAML key: hold, set_point, figure_eight, rest_to_rest
  std::string name;  ///< defaults to the kind
  StageReference reference;
  LeaveCondition leave;
};

// --- the whole ---------------------------------------------------------------------------------

enum class RecordFormat { kCsv, kMcap };

struct Record {
  double flush_s = 0.2;  ///< files are flushed at least this often, ≤ 0.2
  std::vector<RecordFormat> formats{RecordFormat::kCsv};  ///< each once, kCsv among them

  bool has(RecordFormat format) const {
    return std::find(formats.begin(), formats.end(), format) != formats.end();
  }
};

struct Scenario {
  std::string name;
  model::SlungLoadParameters vehicle;
  std::vector<VehicleVariant> vehicles{1};  ///< by id; not empty
  Plant plant;
  std::optional<Autopilot> autopilot;  ///< of plants that have one
  Sync sync;
  Controller controller;
  std::vector<Stage> mission;
  Sensing sensing;
  Estimator estimator;
  std::vector<Fault> faults;  ///< those of one channel act in this order
  Record record;

  /// Follows from plant and vehicles when the file is read: of plants with such a load.
  std::optional<model::SharedLoad> shared_load;

  std::string text;                   ///< the file's bytes
  std::filesystem::path folder;       ///< of the file: paths in it are relative to that
  std::string sha256;                 ///< of those bytes, 64 lower-case hex digits
  std::vector<std::string> warnings;  ///< of what is allowed but hardly meant, as FILE:LINE: …
};

struct Models;  // model_keys.hpp

/// Every model of the project, so that all programs accept the same files and print the same
/// errors. Defined in common/models, which links the models' keys: a program that reads scenarios
/// links sls::models.
const Models& all_models();

/// Reads and checks a scenario file.
/// @throws ConfigError naming file, line, key, expectation and value.
Scenario load_scenario(const std::filesystem::path& file, const Models& models = all_models());

/// The same from text that came over the wire; `place` stands for the file's name in messages.
Scenario parse_scenario(const std::string& text, const std::string& place,
                        const Models& models = all_models());

/// The shared library of the plant or, if the plant is not in one, of its autopilot; empty if
/// neither is in one.
std::filesystem::path find_plant_library(const Scenario& scenario);

/// Writes every value of `scenario` (not `text`) as YAML that reads back to the same values. Leaves
/// out the numbers of the controller's model that equal those of the vehicle (`follows`).
std::string to_yaml(const Scenario& scenario, const Models& models = all_models());

/// `count` equal vehicles on a level square grid, 5 m apart: rows of ⌈√count⌉ along x, the first
/// vehicle at offset zero.
std::vector<VehicleVariant> make_vehicle_grid(std::size_t count);

/// The scenario of vehicle `id` alone: its own parameters, initial position and references, and one
/// entry in `vehicles`. An offset of zero changes no bit. Name, text, hash and faults are those of
/// the fleet; `vehicle` of a fault is still an id in the fleet.
/// @throws std::out_of_range if there is no such vehicle.
Scenario make_vehicle_scenario(const Scenario& scenario, std::uint32_t id);

/// `seconds` in whole nanoseconds, or nothing if it is not a whole number of them (within 1e-3
/// ns, so that 0.004 is exactly 4,000,000).
std::optional<std::int64_t> to_nanoseconds(double seconds);

/// Replaces the control period; the plant step becomes the smaller of the file's and `period_s`.
/// @throws ConfigError as for the key `sync.period_s`, with `place` = "--period-s".
void override_period(Scenario& scenario, double period_s);

/// Replaces the real-time factor.
/// @throws ConfigError as for the key `sync.real_time_factor`, with `place` = "--rtf"; also in
///   lockstep, which has none.
void override_real_time_factor(Scenario& scenario, double factor);

}  // namespace sls::config
