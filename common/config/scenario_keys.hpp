/// Every key of a scenario, once. Reader, writer and the check for unknown keys all go through
/// these functions, each with its own kind of `Map`; a new key is one new line here,
/// and one in docs/reference/scenario.md.
///
///     map.key(presence, "key", field, rule);     one value, map or list of maps
///     map.choose(choice, {{value, {"key", …}}}); exactly one of several alternatives is there
///     map.decide("key", field, describe_others); a required key whose value decides on other keys
///     map.model("key", field, list, section);     a plant or law and the keys of its own
///     map.by_default(field, value);              the value if the file has none
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/config/model_keys.hpp"
#include "common/config/numbers.hpp"
#include "common/config/scenario.hpp"

namespace sls::config {

enum class Presence { kRequired, kOptional };
inline constexpr Presence kRequired = Presence::kRequired;
inline constexpr Presence kOptional = Presence::kOptional;

/// Condition on a number; `expectation` completes "expected …".
struct NumberRule {
  const char* expectation;
  bool (*holds)(double number);
};
inline constexpr double kPi = 3.14159265358979323846;
inline constexpr NumberRule kFinite{"a finite number", [](double) { return true; }};
inline constexpr NumberRule kPositive{"> 0", [](double x) { return x > 0.0; }};
inline constexpr NumberRule kNotNegative{">= 0", [](double x) { return x >= 0.0; }};
inline constexpr NumberRule kProbability{"from 0 to 1",
                                         [](double x) { return x >= 0.0 && x <= 1.0; }};
inline constexpr NumberRule kFullTurn{"radians from -pi to pi",
                                      [](double x) { return -kPi <= x && x <= kPi; }};
inline constexpr NumberRule kHalfTurn{"radians from -pi/2 to pi/2",
                                      [](double x) { return -kPi / 2 <= x && x <= kPi / 2; }};
// Beyond these bounds a wait would overflow a clock.
inline constexpr NumberRule kWait{"> 0 and at most 1000000 s",
                                  [](double x) { return x > 0.0 && x <= kMaxSeconds; }};
inline constexpr NumberRule kRate{"from 0.001 to 1000",
                                  [](double x) { return x >= 1e-3 && x <= 1e3; }};
inline constexpr NumberRule kLowAltitude{"from 3 to 300",
                                         [](double x) { return x >= 3.0 && x <= 300.0; }};
inline constexpr NumberRule kWind{"from -1000 to 1000",
                                  [](double x) { return std::abs(x) <= 1e3; }};
inline constexpr NumberRule kWindSpeed{"> 0 and at most 1000",
                                       [](double x) { return x > 0.0 && x <= 1e3; }};
inline constexpr NumberRule kBatteryNumber{"> 0 and at most 1000000",
                                           [](double x) { return x > 0.0 && x <= 1e6; }};
inline constexpr NumberRule kFlushInterval{"> 0 and <= 0.2",
                                           [](double x) { return x > 0.0 && x <= 0.2; }};

/// Condition on a text.
struct TextRule {
  const char* expectation;
  bool (*holds)(std::string_view text);
};
inline bool is_folder_name(std::string_view text) {
  constexpr std::string_view kInside =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-";
  return !text.empty() && text.size() <= 64 && text[0] != '.' && text[0] != '-' &&
         text.find_first_not_of(kInside) == text.npos;
}
inline bool is_short_label(std::string_view text) {
  for (const char c : text)
    if (c < ' ' || c > '~') return false;
  return !text.empty() && text.size() <= 32;
}
inline constexpr TextRule kFolderName{
    "1 to 64 letters, digits, '_', '.' or '-', not beginning with '.' or '-'", &is_folder_name};
inline constexpr TextRule kShortLabel{"1 to 32 printable ASCII characters", &is_short_label};

/// Bounds of a whole number.
struct Range {
  int least;
  int most;
};
inline constexpr Range kControllers{1, 100};
inline constexpr Range kRecorders{0, 100};
inline constexpr Range kRotorNumbers{1, 64};
inline constexpr Range kVehicleIds{0, static_cast<int>(kMaxVehicles) - 1};

/// Bounds of a number that does not fit an int.
struct WideRange {
  std::uint64_t least;
  std::uint64_t most;
};
inline constexpr WideRange kSeeds{0,
                                  9'223'372'036'854'775'807};  // what readers in any language hold

/// Bounds of a list's length; `elements` names what it holds.
struct ListRange {
  int least;
  int most;
  const char* elements;
};
inline constexpr ListRange kStages{1, 1000, "stages"};
inline constexpr ListRange kFaults{0, 1000, "faults"};
inline constexpr ListRange kGusts{0, 1000, "gusts"};
inline constexpr ListRange kFailures{0, 1000, "failures"};
inline constexpr ListRange kFleet{1, static_cast<int>(kMaxVehicles), "vehicles"};

template <class Enum>
struct Name {
  const char* text;
  Enum value;
};
inline std::array<Name<SyncMode>, 2> names_of(SyncMode) {
  return {{{"lockstep", SyncMode::kLockstep}, {"realtime", SyncMode::kRealtime}}};
}
inline std::array<Name<ControllerPolicy>, 4> names_of(ControllerPolicy) {
  return {{{"wait", ControllerPolicy::kWait},
           {"hold", ControllerPolicy::kHold},
           {"failsafe", ControllerPolicy::kFailsafe},
           {"stop", ControllerPolicy::kStop}}};
}
inline std::array<Name<RecorderPolicy>, 3> names_of(RecorderPolicy) {
  return {{{"wait", RecorderPolicy::kWait},
           {"go_on", RecorderPolicy::kGoOn},
           {"stop", RecorderPolicy::kStop}}};
}
inline std::array<Name<FaultChannel>, 2> names_of(FaultChannel) {
  return {{{"state", FaultChannel::kState}, {"command", FaultChannel::kCommand}}};
}
inline std::array<Name<StateWiring>, 2> names_of(StateWiring) {
  return {{{"correct", StateWiring::kCorrect}, {"gazebo_plugin", StateWiring::kGazeboPlugin}}};
}
inline std::array<Name<RecordFormat>, 2> names_of(RecordFormat) {
  return {{{"csv", RecordFormat::kCsv}, {"mcap", RecordFormat::kMcap}}};
}
inline std::array<Name<Body>, 2> names_of(Body) {
  return {{{"load", Body::kLoad}, {"quadrotor", Body::kQuadrotor}}};
}
inline std::array<Name<CableState>, 2> names_of(CableState) {
  return {{{"taut", CableState::kTaut}, {"slack", CableState::kSlack}}};
}
inline std::array<Name<LoadPlace>, 2> names_of(LoadPlace) {
  return {{{"on_ground", LoadPlace::kOnGround}, {"off_ground", LoadPlace::kOffGround}}};
}

/// One alternative of a choice and the keys that belong to it alone.
template <class Choice>
struct Alternative {
  Choice value;
  std::vector<const char*> keys;
};

/// The `Type` inside `variant`. If `variant` holds another type, it first gets a default `Type`.
template <class Type, class Variant>
Type& as(Variant& variant) {
  if (!std::holds_alternative<Type>(variant)) variant = Type{};
  return std::get<Type>(variant);
}

// --- vehicle and plant ---------------------------------------------------------------------------

template <class Map>
void describe(Map& map, model::SlungLoadParameters& vehicle) {
  map.key(kRequired, "quad_mass_kg", vehicle.quad_mass, kPositive);
  map.key(kRequired, "load_mass_kg", vehicle.load_mass, kPositive);
  map.key(kRequired, "rod_length_m", vehicle.rod_length, kPositive);
  map.key(kRequired, "gravity_m_s2", vehicle.gravity, kPositive);
}

template <class Map>
void describe(Map& map, VehicleVariant& variant) {
  map.key(kOptional, "offset_m", variant.offset);
  map.key(kOptional, "quad_mass_kg", variant.quad_mass, kPositive);
  map.key(kOptional, "load_mass_kg", variant.load_mass, kPositive);
  map.key(kOptional, "rod_length_m", variant.rod_length, kPositive);
  map.key(kOptional, "thrust_scale", variant.thrust_scale, kPositive);
  map.key(kOptional, "quad_velocity_m_s", variant.v_WQ);
  map.key(kOptional, "attitude", variant.q_WB);
  map.key(kOptional, "body_rates_rad_s", variant.w_WB_B);
}

template <class Map>
void describe(Map& map, model::Aerodynamics& air) {
  map.key(kOptional, "rotor_drag_n_s_m", air.rotor_drag, kNotNegative);
  map.key(kOptional, "wind_m_s", air.v_wind_W);
}

template <class Map>
void describe(Map& map, InitialState& initial) {
  map.choose(initial.placed,
             {{Body::kLoad, {"load_position_m"}}, {Body::kQuadrotor, {"quad_position_m"}}});
  map.key(kRequired, initial.placed == Body::kLoad ? "load_position_m" : "quad_position_m",
          initial.position);
  map.key(kOptional, "quad_velocity_m_s", initial.v_WQ);
  map.key(kOptional, "alpha_rad", initial.rod.alpha, kFullTurn);
  map.key(kOptional, "beta_rad", initial.rod.beta, kHalfTurn);
  map.key(kOptional, "alpha_dot_rad_s", initial.rod.alpha_dot, kFinite);
  map.key(kOptional, "beta_dot_rad_s", initial.rod.beta_dot, kFinite);
  map.key(kOptional, "attitude", initial.q_WB);
  map.key(kOptional, "body_rates_rad_s", initial.w_WB_B);
}

template <class Map>
void describe(Map& map, Gust& gust) {
  map.key(kRequired, "at_s", gust.at_ns, kNotNegative);
  map.key(kOptional, "rise_s", gust.rise_ns, kNotNegative);
  map.key(kOptional, "for_s", gust.for_ns, kPositive);
  map.key(kRequired, "wind_m_s", gust.v_wind_W, kWind);
}

template <class Map>
void describe(Map& map, Turbulence& turbulence) {
  map.key(kRequired, "altitude_m", turbulence.altitude, kLowAltitude);
  map.key(kRequired, "w20_m_s", turbulence.w20, kWindSpeed);
  map.key(kOptional, "seed", turbulence.seed, kSeeds);
}

template <class Map>
void describe(Map& map, Wind& wind) {
  map.key(kOptional, "gusts", wind.gusts, kGusts);
  map.key(kOptional, "turbulence", wind.turbulence);
}

template <class Map>
void describe(Map& map, model::LoadDrag& drag) {
  map.key(kOptional, "linear_n_s_m", drag.linear, kNotNegative);
  map.key(kOptional, "area_m2", drag.area, kNotNegative);
  map.key(kOptional, "air_density_kg_m3", drag.air_density, kPositive);
}

template <class Map>
void describe(Map& map, Battery& battery) {
  map.key(kRequired, "full_v", battery.full_v, kBatteryNumber);
  map.key(kRequired, "empty_v", battery.empty_v, kBatteryNumber);
  map.key(kOptional, "resistance_ohm", battery.resistance_ohm, kNotNegative);
  map.key(kRequired, "capacity_ah", battery.capacity_ah, kBatteryNumber);
  map.key(kRequired, "hover_power_w", battery.hover_power_w, kBatteryNumber);
}

template <class Map>
void describe(Map& map, ThrustFailure& failure) {
  map.key(kRequired, "at_s", failure.at_ns, kNotNegative);
  map.key(kOptional, "vehicle", failure.vehicle, kVehicleIds);
  map.key(kOptional, "rotor", failure.rotor, kRotorNumbers);
  map.key(kOptional, "thrust_scale", failure.scale, kNotNegative);
}

template <class Map>
void describe(Map& map, Thrust& thrust) {
  map.key(kOptional, "scale", thrust.scale, kPositive);
  map.key(kOptional, "drift_per_s", thrust.drift, kFinite);
  map.key(kOptional, "battery", thrust.battery);
  map.key(kOptional, "failures", thrust.failures, kFailures);
}

/// Wind that changes, drag of the load, and what the thrust lacks.
template <class Map>
void describe_surroundings(Map& map, Plant& plant) {
  map.key(kOptional, "wind", plant.wind);
  map.key(kOptional, "load_drag", plant.load_drag);
  map.key(kOptional, "thrust", plant.thrust);
}

/// Effects on the quadrotor of a point-mass plant besides the control force.
template <class Map>
void describe_point_mass_loads(Map& map, Plant& plant) {
  describe(map, plant.air);
  describe_surroundings(map, plant);
  map.key(kOptional, "disturbance_n", plant.disturbance_W);
}

template <class Map>
void describe(Map& map, Plant& plant) {
  map.model("model", plant.model, &Models::plants, plant);
  map.key(kOptional, "step_s", plant.step_ns, kPositive);
  map.key(kRequired, "initial", plant.initial);
}

/// The key of an autopilot with its own period.
template <class Map>
void describe_period(Map& map, Autopilot& autopilot) {
  constexpr std::int64_t kUsual = 4'000'000;  // ns
  map.by_default(autopilot.period_ns, kUsual);
  map.key(kOptional, "period_s", autopilot.period_ns, kPositive);
}

template <class Map>
void describe(Map& map, Autopilot& autopilot) {
  map.model("model", autopilot.model, &Models::autopilots, autopilot);
}

// --- synchronisation -----------------------------------------------------------------------------

template <class Map>
void describe(Map& map, WaitFor& wait_for) {
  map.key(kOptional, "controllers", wait_for.controllers, kControllers);
  map.key(kOptional, "recorders", wait_for.recorders, kRecorders);
  map.key(kOptional, "timeout_s", wait_for.timeout_s, kWait);
}

template <class Map, class Policy>
void describe(Map& map, Absence<Policy>& absence, double patience_s) {
  constexpr double kPromptly = 1.0;  // s
  map.key(kOptional, "policy", absence.policy);
  map.by_default(absence.deadline_s, absence.policy == Policy::kWait ? patience_s : kPromptly);
  map.key(kOptional, "deadline_s", absence.deadline_s, kWait);
}

/// Time limit of clients and recorders for a silent server.
struct ServerAbsence {
  double& deadline_s;
};
template <class Map>
void describe(Map& map, ServerAbsence& server) {
  map.key(kOptional, "deadline_s", server.deadline_s, kWait);
}

template <class Map>
void describe(Map& map, WaitPolicies& wait, double patience_s) {
  ServerAbsence server{wait.server_deadline_s};
  map.key(kOptional, "controller", wait.controller, patience_s);
  map.key(kOptional, "recorder", wait.recorder, patience_s);
  map.key(kOptional, "server", server);
}

template <class Map>
void describe(Map& map, Sync& sync) {
  map.key(kOptional, "mode", sync.mode);
  map.key(kOptional, "period_s", sync.period_ns, kPositive);
  map.key(kOptional, "real_time_factor", sync.real_time_factor, kRate);
  map.key(kOptional, "take_over_s", sync.take_over_s, kWait);
  map.key(kOptional, "max_hold_s", sync.max_hold_s, kNotNegative);
  map.key(kOptional, "wait_for", sync.wait_for);
  const double patience_s = sync.wait_for.timeout_s;
  map.by_default(sync.wait.controller.deadline_s, patience_s);
  map.by_default(sync.wait.recorder.deadline_s, patience_s);
  map.by_default(sync.wait.server_deadline_s, patience_s);
  map.key(kOptional, "wait", sync.wait, patience_s);
}

// --- controller ----------------------------------------------------------------------------------

/// A number that equals the true one unless the file has it.
template <class Map>
void describe_believed(Map& map, const char* name, double& number, bool& follows) {
  std::optional<double> own = follows ? std::nullopt : std::optional(number);
  map.key(kOptional, name, own, kPositive);
  number = own.value_or(number);
  follows = !own;
}

template <class Map>
void describe(Map& map, ControllerModel& believed) {
  model::SlungLoadParameters& vehicle = believed.vehicle;
  ControllerModel::Follows& follows = believed.follows;
  describe_believed(map, "quad_mass_kg", vehicle.quad_mass, follows.quad_mass);
  describe_believed(map, "load_mass_kg", vehicle.load_mass, follows.load_mass);
  describe_believed(map, "rod_length_m", vehicle.rod_length, follows.rod_length);
  map.key(kOptional, "gravity_m_s2", vehicle.gravity, kPositive);
  describe(map, believed.air);
}

template <class Map>
void describe(Map& map, Controller& controller) {
  map.model("law", controller.law, &Models::laws, controller);
  map.key(kOptional, "force_limit_n", controller.force_limit_n, kPositive);
  map.key(kOptional, "saturate", controller.saturate);
  map.key(kOptional, "drag_feed_forward", controller.drag_feed_forward);
  map.key(kOptional, "state_wiring", controller.state_wiring);
  map.key(kOptional, "model", controller.model);
}

// --- mission -------------------------------------------------------------------------------------

template <class Map>
void describe(Map& map, ConstantReference& reference) {
  map.key(kRequired, "position_m", reference.position);
  map.key(kOptional, "attitude_rad", reference.attitude, kFullTurn);
}

template <class Map>
void describe(Map& map, FigureEightReference& reference) {
  map.key(kRequired, "amplitude_m", reference.amplitude);
  map.key(kOptional, "offset_m", reference.offset);
  map.key(kRequired, "period_s", reference.period_s, kPositive);
  map.key(kOptional, "attitude_rad", reference.attitude, kFullTurn);
}

template <class Map>
void describe(Map& map, RestToRestReference& reference) {
  map.key(kRequired, "from_m", reference.from);
  map.key(kRequired, "to_m", reference.to);
  map.key(kRequired, "duration_s", reference.duration_s, kPositive);
  map.key(kOptional, "from_attitude_rad", reference.from_attitude, kFullTurn);
  map.key(kOptional, "to_attitude_rad", reference.to_attitude, kFullTurn);
}

template <class Map>
void describe(Map& map, LeaveUntil& leave) {
  constexpr std::int64_t kPatience = 60'000'000'000;  // ns
  using Condition = LeaveUntil::Condition;
  map.choose(leave.condition, {{Condition::kWithin, {"within_m", "of", "offset_m"}},
                               {Condition::kCable, {"cable"}},
                               {Condition::kLoad, {"load"}},
                               {Condition::kTensionAbove, {"tension_above_n"}},
                               {Condition::kTensionBelow, {"tension_below_n"}}});
  if (leave.condition == Condition::kWithin) {
    map.key(kRequired, "within_m", leave.radius_m, kPositive);
    map.key(kOptional, "of", leave.body);
    map.key(kOptional, "offset_m", leave.offset);
  } else if (leave.condition == Condition::kCable) {
    map.key(kRequired, "cable", leave.cable);
  } else if (leave.condition == Condition::kLoad) {
    map.key(kRequired, "load", leave.load);
  } else if (leave.condition == Condition::kTensionAbove) {
    map.key(kRequired, "tension_above_n", leave.tension_n, kNotNegative);
  } else {
    map.key(kRequired, "tension_below_n", leave.tension_n, kPositive);
  }
  map.key(kOptional, "after_s", leave.after_ns, kNotNegative);
  map.by_default(leave.timeout_ns, std::min(leave.after_ns + kPatience, kMaxNanoseconds));
  map.key(kOptional, "timeout_s", leave.timeout_ns, kPositive);
}

template <class Map>
void describe(Map& map, Stage& stage) {
  map.choose(stage.kind, {{"hold", {"hold"}},
                          {"set_point", {"set_point"}},
                          {"figure_eight", {"figure_eight"}},
                          {"rest_to_rest", {"rest_to_rest"}}});
  if (stage.kind == "figure_eight")
    map.key(kRequired, "figure_eight", as<FigureEightReference>(stage.reference));
  else if (stage.kind == "rest_to_rest")
    map.key(kRequired, "rest_to_rest", as<RestToRestReference>(stage.reference));
  else if (stage.kind == "hold" || stage.kind == "set_point")
    map.key(kRequired, stage.kind.c_str(), as<ConstantReference>(stage.reference));

  map.by_default(stage.name, stage.kind);
  map.key(kOptional, "name", stage.name, kShortLabel);

  bool timed = std::holds_alternative<LeaveAfter>(stage.leave);
  map.choose(timed, {{true, {"for_s"}}, {false, {"until"}}});
  if (timed)
    map.key(kRequired, "for_s", as<LeaveAfter>(stage.leave).duration_ns, kPositive);
  else
    map.key(kRequired, "until", as<LeaveUntil>(stage.leave));
}

// --- sensing -------------------------------------------------------------------------------------

template <class Map>
void describe(Map& map, SampleTimes& times) {
  map.key(kOptional, "period_s", times.period_ns, kNotNegative);
  map.key(kOptional, "age_s", times.age_ns, kNotNegative);
}

template <class Map>
void describe(Map& map, Sensing& sensing) {
  describe(map, sensing.body);
  map.by_default(sensing.rod, sensing.body);
  map.key(kOptional, "rod", sensing.rod);
  map.key(kOptional, "node_delay_s", sensing.node_delay_ns, kNotNegative);
}

template <class Map>
void describe(Map& map, Estimator& estimator) {
  map.key(kOptional, "position_m", estimator.position);
  map.key(kOptional, "velocity_m_s", estimator.velocity);
  map.key(kOptional, "tilt_rad", estimator.attitude.tilt, kHalfTurn);
  map.key(kOptional, "yaw_rad", estimator.attitude.yaw, kFullTurn);
}

// --- faults --------------------------------------------------------------------------------------

template <class Map>
void describe_effect(Map& map, DelayFault& delay, FaultChannel) {
  map.key(kRequired, "by_s", delay.by_ns, kNotNegative);
}

template <class Map>
void describe_effect(Map& map, DropFault& drop, FaultChannel) {
  map.key(kRequired, "probability", drop.probability, kProbability);
  map.key(kOptional, "seed", drop.seed, kSeeds);
}

template <class Map>
void describe_effect(Map&, FreezeFault&, FaultChannel) {}

template <class Map>
void describe_effect(Map& map, ReorderFault& reorder, FaultChannel) {
  map.key(kRequired, "probability", reorder.probability, kProbability);
  map.key(kOptional, "seed", reorder.seed, kSeeds);
}

/// Condition on the numbers of a bias or a noise.
struct OffsetRules {
  NumberRule number;
  NumberRule alpha;
  NumberRule beta;
};

template <class Map>
void describe_offset(Map& map, SampleOffset& offset, FaultChannel on, const OffsetRules& rules) {
  if (on == FaultChannel::kCommand) {
    map.key(kOptional, "force_n", offset.force, rules.number);
    return;
  }
  map.key(kOptional, "position_m", offset.position, rules.number);
  map.key(kOptional, "velocity_m_s", offset.velocity, rules.number);
  map.key(kOptional, "alpha_rad", offset.rod.alpha, rules.alpha);
  map.key(kOptional, "beta_rad", offset.rod.beta, rules.beta);
  map.key(kOptional, "alpha_dot_rad_s", offset.rod.alpha_dot, rules.number);
  map.key(kOptional, "beta_dot_rad_s", offset.rod.beta_dot, rules.number);
}

template <class Map>
void describe_effect(Map& map, BiasFault& bias, FaultChannel on) {
  describe_offset(map, bias.offset, on, {kFinite, kFullTurn, kHalfTurn});
}

template <class Map>
void describe_effect(Map& map, NoiseFault& noise, FaultChannel on) {
  map.key(kOptional, "seed", noise.seed, kSeeds);
  describe_offset(map, noise.deviation, on, {kNotNegative, kNotNegative, kNotNegative});
}

/// The map under a fault's kind: the keys of its effect and those that every fault has.
template <class Effect>
struct FaultBody {
  Fault& fault;
  Effect& effect;
};

template <class Map, class Effect>
void describe(Map& map, FaultBody<Effect>& body) {
  map.decide("on", body.fault.on, [&](FaultChannel on) { describe_effect(map, body.effect, on); });
  map.key(kOptional, "vehicle", body.fault.vehicle, kVehicleIds);
  map.key(kOptional, "from_s", body.fault.from_ns, kNotNegative);
  map.key(kOptional, "to_s", body.fault.to_ns, kPositive);
}

template <class Effect, class Map>
void describe_body(Map& map, Fault& fault) {
  FaultBody<Effect> body{fault, as<Effect>(fault.effect)};
  map.key(kRequired, fault.kind.c_str(), body);
}

template <class Map>
void describe(Map& map, Fault& fault) {
  map.choose(fault.kind, {{"delay", {"delay"}},
                          {"drop", {"drop"}},
                          {"freeze", {"freeze"}},
                          {"reorder", {"reorder"}},
                          {"bias", {"bias"}},
                          {"noise", {"noise"}}});
  if (fault.kind == "delay")
    describe_body<DelayFault>(map, fault);
  else if (fault.kind == "drop")
    describe_body<DropFault>(map, fault);
  else if (fault.kind == "freeze")
    describe_body<FreezeFault>(map, fault);
  else if (fault.kind == "reorder")
    describe_body<ReorderFault>(map, fault);
  else if (fault.kind == "bias")
    describe_body<BiasFault>(map, fault);
  else if (fault.kind == "noise")
    describe_body<NoiseFault>(map, fault);
}

// --- the whole -----------------------------------------------------------------------------------

template <class Map>
void describe(Map& map, Record& record) {
  map.key(kOptional, "flush_s", record.flush_s, kFlushInterval);
  map.key(kOptional, "format", record.formats);
}

template <class Map>
void describe(Map& map, Scenario& scenario) {
  map.key(kRequired, "name", scenario.name, kFolderName);
  map.key(kRequired, "vehicle", scenario.vehicle);
  map.key(kOptional, "vehicles", scenario.vehicles, kFleet);
  map.key(kRequired, "plant", scenario.plant);
  map.key(kOptional, "autopilot", scenario.autopilot);
  map.key(kOptional, "sync", scenario.sync);
  map.by_default(scenario.controller.model,
                 ControllerModel{scenario.vehicle, scenario.plant.air, {true, true, true}});
  map.key(kOptional, "controller", scenario.controller);
  map.key(kRequired, "mission", scenario.mission, kStages);
  map.key(kOptional, "sensing", scenario.sensing);
  map.key(kOptional, "estimator", scenario.estimator);
  map.key(kOptional, "faults", scenario.faults, kFaults);
  map.key(kOptional, "record", scenario.record);
}

}  // namespace sls::config
