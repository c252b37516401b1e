/// A scenario: everything that decides a run. Read from one YAML file (README.md lists every key).
/// Programs and tests share these plain structs; all values are SI, times whole nanoseconds.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/config/config_error.hpp"
#include "common/model/parameters.hpp"
#include "common/model/state.hpp"

namespace sls::config {

/// A scenario travels whole in `sls/parameters`, whose string is bounded by this.
inline constexpr std::size_t kMaxScenarioBytes = 32768;

// --- plant -------------------------------------------------------------------------------------

enum class Pendulum {
  kIdeal,  ///< point load on a massless rod
  kRigid,  ///< the published links: base, rod with inertia, load with inertia
};

enum class Body { kQuadrotor, kLoad };

/// Where the bodies are at step 0: one of them is placed, the rod angles give the other.
struct InitialState {
  Body placed = Body::kLoad;                           ///< `load_position_m` or `quad_position_m`
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the placed body, m
  Eigen::Vector3d v_WQ = Eigen::Vector3d::Zero();      ///< quadrotor velocity, m/s
  model::RodAngles rod;
};

struct Plant {
  Pendulum pendulum = Pendulum::kIdeal;
  std::int64_t step_ns = 1'000'000;  ///< integration step
  InitialState initial;
  model::Aerodynamics air;                                  ///< true drag and wind
  Eigen::Vector3d disturbance_W = Eigen::Vector3d::Zero();  ///< d, constant, on the quadrotor, N
};

// --- synchronisation ---------------------------------------------------------------------------

enum class SyncMode { kLockstep, kRealtime };

/// Who must be ready before step 0.
struct WaitFor {
  int controllers = 1;
  int recorders = 1;
  double timeout_s = 30.0;
};

struct Sync {
  SyncMode mode = SyncMode::kLockstep;
  std::int64_t period_ns = 4'000'000;  ///< control period, a multiple of the plant's step
  double real_time_factor = 1.0;       ///< of `realtime`
  double take_over_s = 0.1;            ///< silence after which the next-strongest client answers
  WaitFor wait_for;
};

// --- controller --------------------------------------------------------------------------------

/// Gains of one output axis, named by what they multiply. The vertical chain has no acceleration
/// and jerk gain: they stay 0.
struct AxisGains {
  double position = 0.0;
  double velocity = 0.0;
  double acceleration = 0.0;
  double jerk = 0.0;
  double integral = 0.0;
};

struct NamedGains {
  AxisGains horizontal;
  AxisGains vertical;
};

/// Gains from LQR on the integrator chains, Q = weight · I, R = 1.
struct LqrWeights {
  double horizontal = 10.0;
  double vertical = 5.0;
};

using Gains = std::variant<LqrWeights, NamedGains>;

enum class StateWiring {
  kCorrect,
  kGazeboPlugin,  ///< the published plugin's permuted angle slots
};

/// What the controller believes; what the file leaves out equals the plant's truth.
struct ControllerModel {
  model::SlungLoadParameters vehicle;
  model::Aerodynamics air;
};

struct Controller {
  std::string law = "qsf";
  Gains gains = LqrWeights{};
  double force_limit_n = 200.0;  ///< commands beyond are refused by the server
  bool saturate = false;         ///< the client scales the force to the limit
  bool drag_feed_forward = false;
  StateWiring state_wiring = StateWiring::kCorrect;
  ControllerModel model;
};

// --- mission -----------------------------------------------------------------------------------

/// Constant reference: the stages `hold` and `set_point`.
struct ConstantReference {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m
};

/// offset + (a_x sin 2πt/T, a_y sin 4πt/T, a_z sin 2πt/T).
struct FigureEightReference {
  Eigen::Vector3d amplitude = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();     ///< m
  double period_s = 16.0;                               ///< T of one lap, s
};

/// Ninth-degree polynomial from rest to rest in `duration_s`, then constant.
struct RestToRestReference {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d to = Eigen::Vector3d::Zero();    ///< m
  double duration_s = 1.0;
};

using StageReference = std::variant<ConstantReference, FigureEightReference, RestToRestReference>;

/// The stage ends at the first step that is `duration` after its start.
struct LeaveAfter {
  std::int64_t duration_ns = 0;
};

/// The stage ends at the first step later than `after` at which the body is within the radius of
/// the reference position plus `offset`; the mission fails if that has not happened by `timeout`.
struct LeaveWithin {
  std::int64_t after_ns = 0;
  double radius_m = 0.2;
  Body body = Body::kLoad;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< m
  std::int64_t timeout_ns = 0;
};

using LeaveCondition = std::variant<LeaveAfter, LeaveWithin>;

struct Stage {
  std::string kind;  ///< the YAML key: hold, set_point, figure_eight, rest_to_rest
  std::string name;  ///< defaults to the kind
  StageReference reference;
  LeaveCondition leave;
};

// --- the whole ---------------------------------------------------------------------------------

struct Record {
  double flush_s = 0.2;  ///< files are flushed at least this often, ≤ 0.2
};

struct Scenario {
  std::string name;
  model::SlungLoadParameters vehicle;
  Plant plant;
  Sync sync;
  Controller controller;
  std::vector<Stage> mission;
  Record record;

  std::string text;    ///< the file's bytes
  std::string sha256;  ///< of those bytes, 64 lower-case hex digits
};

/// Reads and checks a scenario file.
/// @throws ConfigError naming file, line, key, expectation and value.
Scenario load_scenario(const std::filesystem::path& file);

/// The same from text that came over the wire; `place` stands for the file's name in messages.
Scenario parse_scenario(const std::string& text, const std::string& place);

/// Writes every value of `scenario` (not `text`) as YAML that reads back to the same values.
std::string to_yaml(const Scenario& scenario);

/// `seconds` in whole nanoseconds, or nothing where it is not a whole number of them (within 1e-3
/// ns, so that 0.004 is exactly 4,000,000).
std::optional<std::int64_t> to_nanoseconds(double seconds);

/// Puts another control period in force: the step becomes the smaller of the file's and `period_s`.
/// @throws ConfigError as for the key `sync.period_s`, with `place` = "--period-s".
void override_period(Scenario& scenario, double period_s);

}  // namespace sls::config
