#include "common/config/scenario.hpp"

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <system_error>

#include "common/config/numbers.hpp"
#include "common/config/scenario_reader.hpp"
#include "common/config/scenario_writer.hpp"
#include "common/text/sha256.hpp"

namespace sls::config {
namespace {

/// Limits of delays, because a delay keeps its samples in memory.
constexpr std::int64_t kMaxDelayPeriods = 100'000;
constexpr std::int64_t kMaxSamplesUnderWay = 100'000;

void check_size(const std::string& text, const std::string& place) {
  if (text.size() > kMaxScenarioBytes)
    throw make_error(place, 0, "",
                     "expected at most " + std::to_string(kMaxScenarioBytes) + " bytes, got " +
                         std::to_string(text.size()));
}

/// Replaces the numbers that all vehicles have by the vehicle's own.
void put_own(const VehicleVariant& variant, model::SlungLoadParameters& vehicle) {
  vehicle.quad_mass = variant.quad_mass.value_or(vehicle.quad_mass);
  vehicle.load_mass = variant.load_mass.value_or(vehicle.load_mass);
  vehicle.rod_length = variant.rod_length.value_or(vehicle.rod_length);
}

/// Index of the first timed stage whose duration is not a multiple of the control period.
std::optional<std::size_t> find_stage_off_period(const Scenario& scenario) {
  for (std::size_t i = 0; i < scenario.mission.size(); ++i) {
    const auto* timed = std::get_if<LeaveAfter>(&scenario.mission[i].leave);
    if (timed && timed->duration_ns % scenario.sync.period_ns != 0) return i;
  }
  return std::nullopt;
}

/// A delay of a fault that does not fit the control period.
struct DelayMismatch {
  std::size_t fault = 0;
  std::int64_t by_ns = 0;
  bool is_too_long = false;  ///< else: not a whole number of periods
};
std::optional<DelayMismatch> find_delay_mismatch(const Scenario& scenario) {
  std::int64_t periods[] = {0, 0};  // of each channel: delays add up, those of all vehicles too
  for (std::size_t i = 0; i < scenario.faults.size(); ++i) {
    const Fault& fault = scenario.faults[i];
    const auto* delay = std::get_if<DelayFault>(&fault.effect);
    if (!delay) continue;
    if (delay->by_ns % scenario.sync.period_ns != 0) return DelayMismatch{i, delay->by_ns, false};
    std::int64_t& total = periods[fault.on == FaultChannel::kState ? 0 : 1];
    total += delay->by_ns / scenario.sync.period_ns;
    if (total > kMaxDelayPeriods) return DelayMismatch{i, delay->by_ns, true};
  }
  return std::nullopt;
}

std::string to_fault_path(const Scenario& scenario, std::size_t index) {
  return "faults[" + std::to_string(index) + "]." + scenario.faults[index].kind;
}

std::string to_stage_path(std::size_t index) { return "mission[" + std::to_string(index) + "]"; }

std::string to_seconds_text(std::int64_t nanoseconds) { return to_text(to_seconds(nanoseconds)); }

std::string to_mismatch(const char* relation, const std::string& of, std::int64_t expected_ns,
                        std::int64_t got_ns) {
  return std::string("expected a ") + relation + " of " + of + " (" + to_seconds_text(expected_ns) +
         "), got " + to_seconds_text(got_ns);
}

void check_times(const Scenario& scenario, const Places& places) {
  const std::int64_t step = scenario.plant.step_ns, period = scenario.sync.period_ns;
  if (period % step != 0 && !places.has("sync.period_s"))
    throw places.make_error_at("plant.step_s",
                               to_mismatch("divisor", "sync.period_s", period, step));
  if (period % step != 0)
    throw places.make_error_at("sync.period_s",
                               to_mismatch("multiple", "plant.step_s", step, period));
  if (const auto index = find_stage_off_period(scenario)) {
    const auto& leave = std::get<LeaveAfter>(scenario.mission[*index].leave);
    throw places.make_error_at(to_stage_path(*index) + ".for_s",
                               to_mismatch("multiple", "sync.period_s", period, leave.duration_ns));
  }
  for (std::size_t i = 0; i < scenario.mission.size(); ++i) {
    const auto* leave = std::get_if<LeaveUntil>(&scenario.mission[i].leave);
    if (leave && leave->timeout_ns <= leave->after_ns)
      throw places.make_error_at(to_stage_path(i) + ".until.timeout_s",
                                 "expected > after_s (" + to_seconds_text(leave->after_ns) +
                                     "), got " + to_seconds_text(leave->timeout_ns));
  }
}

std::string to_too_long(std::int64_t period_ns) {
  return "delays of one channel of at most " + std::to_string(kMaxDelayPeriods) + " periods (" +
         to_seconds_text(kMaxDelayPeriods * period_ns) + " s)";
}

/// Checks the keys of plants whose vehicles have an attitude, and of their autopilot.
void check_autopilot(const Scenario& scenario, const Places& places) {
  const ModelName& model = scenario.plant.model;
  const auto& plants = places.models().plants;
  if (model.is_shared_library() || !find_model_keys(plants, model).has_attitude(scenario.plant)) {
    std::string takers;
    for (const auto& [name, keys] : plants) {
      const std::string key = keys->find_attitude_key();
      if (key.empty() && !keys->has_attitude(Plant())) continue;
      takers += (takers.empty() ? "'" : " or '") + name + "'" + (key.empty() ? "" : " with " + key);
    }
    std::vector<std::string> keys = {"autopilot", "plant.initial.attitude",
                                     "plant.initial.body_rates_rad_s"};
    for (std::size_t i = 0; i < scenario.vehicles.size(); ++i)
      for (const char* key : {"attitude", "body_rates_rad_s"})
        keys.push_back("vehicles[" + std::to_string(i) + "]." + key);
    for (const std::string& key : keys)
      if (places.has(key))
        throw places.make_error_at(key, "of plant.model " + takers + " alone, here it is '" +
                                            scenario.plant.model.name + "'");
  }
  const std::int64_t period = scenario.autopilot ? scenario.autopilot->period_ns : 0;
  if (period % scenario.plant.step_ns != 0)
    throw places.make_error_at("autopilot.period_s", to_mismatch("multiple", "plant.step_s",
                                                                 scenario.plant.step_ns, period));
  if (scenario.autopilot)
    find_model_keys(places.models().autopilots, scenario.autopilot->model).check(scenario, places);
}

/// Nothing if `offset` changes the samples of channel `on`; else the keys of which one is missing.
std::optional<std::string> find_missing_offset(const SampleOffset& offset, FaultChannel on) {
  const model::RodAngles& rod = offset.rod;
  if (on == FaultChannel::kCommand)
    return offset.force.isZero(0.0) ? std::optional("force_n") : std::nullopt;
  const bool is_zero = offset.position.isZero(0.0) && offset.velocity.isZero(0.0) &&
                       rod.alpha == 0.0 && rod.beta == 0.0 && rod.alpha_dot == 0.0 &&
                       rod.beta_dot == 0.0;
  return is_zero ? std::optional(
                       "position_m, velocity_m_s, alpha_rad, beta_rad, "
                       "alpha_dot_rad_s or beta_dot_rad_s")
                 : std::nullopt;
}

void check_vehicle(int id, const std::string& path, const Scenario& scenario,
                   const Places& places) {
  const std::size_t count = scenario.vehicles.size();
  if (static_cast<std::size_t>(id) >= count)
    throw places.make_error_at(path, "expected < the number of vehicles (" + std::to_string(count) +
                                         "), got " + std::to_string(id));
}

void check_faults(const Scenario& scenario, const Places& places) {
  for (std::size_t i = 0; i < scenario.faults.size(); ++i) {
    const Fault& fault = scenario.faults[i];
    const std::string path = to_fault_path(scenario, i);
    check_vehicle(fault.vehicle, path + ".vehicle", scenario, places);
    if (fault.to_ns <= fault.from_ns)
      throw places.make_error_at(path + ".to_s", "expected > from_s (" +
                                                     to_seconds_text(fault.from_ns) + "), got " +
                                                     to_seconds_text(fault.to_ns));
    std::optional<std::string> missing;
    if (const auto* bias = std::get_if<BiasFault>(&fault.effect))
      missing = find_missing_offset(bias->offset, fault.on);
    if (const auto* noise = std::get_if<NoiseFault>(&fault.effect))
      missing = find_missing_offset(noise->deviation, fault.on);
    if (missing)
      throw places.make_error_at(path, "expected " + *missing + " other than 0, got none");
  }
  if (const auto mismatch = find_delay_mismatch(scenario)) {
    const std::int64_t period = scenario.sync.period_ns;
    throw places.make_error_at(
        to_fault_path(scenario, mismatch->fault) + ".by_s",
        mismatch->is_too_long
            ? "expected " + to_too_long(period) + ", got " + to_seconds_text(mismatch->by_ns)
            : to_mismatch("multiple", "sync.period_s", period, mismatch->by_ns));
  }
}

/// An age or a delay of `sensing`: its key, its value and the time between samples, which limits
/// the number of samples.
struct SensingTime {
  const char* key;
  std::int64_t age_ns;
  std::int64_t interval_ns;
};
std::array<SensingTime, 3> list_sensing_times(const Scenario& scenario) {
  const Sensing& sensing = scenario.sensing;
  const std::int64_t step = scenario.plant.step_ns;
  return {{{"sensing.age_s", sensing.body.age_ns, std::max(sensing.body.period_ns, step)},
           {"sensing.rod.age_s", sensing.rod.age_ns, std::max(sensing.rod.period_ns, step)},
           {"sensing.node_delay_s", sensing.node_delay_ns, step}}};
}

/// The first of them that causes too many samples.
std::optional<SensingTime> find_too_many_samples(const Scenario& scenario) {
  for (const SensingTime& time : list_sensing_times(scenario))
    if (time.age_ns / time.interval_ns > kMaxSamplesUnderWay) return time;
  return std::nullopt;
}
std::string to_too_many(const SensingTime& time) {
  return "expected at most " + std::to_string(kMaxSamplesUnderWay) + " samples of " +
         to_seconds_text(time.interval_ns) + " s under way, got " + to_seconds_text(time.age_ns);
}

/// Longest possible duration of the flight.
std::int64_t calc_longest_flight_ns(const Scenario& scenario) {
  std::int64_t sum = 0;
  for (const Stage& stage : scenario.mission) {
    const auto* timed = std::get_if<LeaveAfter>(&stage.leave);
    sum += timed ? timed->duration_ns : std::get<LeaveUntil>(stage.leave).timeout_ns;
  }
  return sum;
}

void check_sensing(const Scenario& scenario, const Places& places) {
  const std::int64_t longest = calc_longest_flight_ns(scenario);
  for (const SensingTime& time : list_sensing_times(scenario))
    if (time.age_ns > longest)
      throw places.make_error_at(time.key, "expected at most the longest flight of the mission (" +
                                               to_seconds_text(longest) + "), got " +
                                               to_seconds_text(time.age_ns));
  if (const auto time = find_too_many_samples(scenario))
    throw places.make_error_at(time->key, to_too_many(*time));
}

void check_estimator(const Scenario& scenario, const Places& places) {
  const ModelName& model = scenario.plant.model;
  const model::AttitudeError& error = scenario.estimator.attitude;
  if (error.is_zero() ||
      find_model_keys(places.models().plants, model).has_attitude(scenario.plant))
    return;
  const bool is_tilted = !error.tilt.isZero(0.0);
  throw places.make_error_at(
      is_tilted ? "estimator.tilt_rad" : "estimator.yaw_rad",
      "expected a plant with an attitude, or 0; model is '" + model.name + "', got " +
          (is_tilted ? to_yaml_value(error.tilt) : to_yaml_value(error.yaw)));
}

/// Attitudes of stages are those of a rigid load that vehicles carry together.
void check_attitudes(const Scenario& scenario, const Places& places) {
  if (scenario.shared_load && scenario.shared_load->inertia_L) return;
  for (std::size_t i = 0; i < scenario.mission.size(); ++i)
    for (const char* key : {"attitude_rad", "from_attitude_rad", "to_attitude_rad"}) {
      const std::string path = to_stage_path(i) + "." + scenario.mission[i].kind + "." + key;
      if (places.has(path))
        throw places.make_error_at(
            path, "of a load that is a rigid body and hangs on cables (plant.load_inertia_kg_m2)");
    }
}

/// Bound of the rate with which the drag of the load slows it, 1/s.
double calc_drag_rate(const Scenario& scenario) {
  const model::LoadDrag& drag = scenario.plant.load_drag;
  double speed = scenario.plant.air.v_wind_W.norm() + scenario.plant.initial.v_WQ.norm();
  for (const Gust& gust : scenario.plant.wind.gusts) speed += gust.v_wind_W.norm();
  double mass = scenario.shared_load ? 0.0 : std::numeric_limits<double>::infinity();
  for (const VehicleVariant& own : scenario.vehicles) {
    const double load = own.load_mass.value_or(scenario.vehicle.load_mass);
    mass = scenario.shared_load ? mass + load : std::min(mass, load);
  }
  return (drag.linear + drag.air_density * drag.area * speed) / mass;
}

/// Refuses a step that is too coarse for the fastest motion, and warns of one that is hardly fine
/// enough (sim_server/plants/README.md). A plant in a library has steps of its own.
void check_step(Scenario& scenario, const Places& places) {
  constexpr double kMost = 1.0, kFine = 0.25;  // of rate × step
  if (scenario.plant.model.is_shared_library()) return;
  const auto& plant = find_model_keys(places.models().plants, scenario.plant.model);
  double swing = 0.0;
  for (std::uint32_t id = 0; id < scenario.vehicles.size(); ++id)
    swing = std::max(swing, plant.calc_swing_rate(scenario, id));
  const double step = to_seconds(scenario.plant.step_ns);
  const auto judge = [&](double rate, const char* of, const char* unit, const char* effect) {
    if (rate * step <= kFine) return;
    const bool is_refused = !(rate * step <= kMost);
    const double most = std::floor((is_refused ? kMost : kFine) / rate * 1e6) / 1e6;
    const ConfigError error = places.make_error_at(
        "plant.step_s", "expected at most " + to_text(most) + " for " + of + " " +
                            to_text(std::round(rate * 10.0) / 10.0) + " " + unit + ", got " +
                            to_text(step) + (is_refused ? "" : effect));
    if (is_refused) throw error;
    scenario.warnings.push_back(error.what());
  };
  judge(swing, "a swing of", "rad/s", ": the swing loses energy");
  judge(plant.calc_spring_rate(scenario), "a cable that stretches with", "1/s",
        ": its oscillation loses energy");
  judge(calc_drag_rate(scenario), "a load that its drag slows with", "1/s",
        ": its drag is less exact");
}

/// The mean wind carries turbulence, at a speed of the air, past bodies that are near the origin.
void check_wind(const Scenario& scenario, const Places& places) {
  if (!scenario.plant.wind.turbulence) return;
  constexpr double kMost = 100.0;  // m/s
  const Eigen::Vector2d mean = scenario.plant.air.v_wind_W.head<2>();
  const double speed = std::sqrt(mean.squaredNorm());
  if (!(speed > 0.0 && speed <= kMost))
    throw places.make_error_at("plant.wind.turbulence",
                               "expected a plant.wind_m_s that carries it, level with > 0 and at "
                               "most 100 m/s, got " +
                                   to_text(speed));
  for (std::uint32_t id = 0; id < scenario.vehicles.size(); ++id) {
    const Eigen::Vector3d start = make_vehicle_scenario(scenario, id).plant.initial.position;
    const double along = (mean.x() * start.x() + mean.y() * start.y()) / speed;
    if (!(std::abs(along) <= Turbulence::kReach))
      throw places.make_error_at("plant.initial",
                                 "expected vehicle " + std::to_string(id) +
                                     " within 500 m of the origin along the wind, as "
                                     "plant.wind.turbulence needs, got " +
                                     to_text(along) + " m");
  }
}

/// Failures are of vehicles and rotors that are there, and a battery can give the power to hover.
void check_thrust(const Scenario& scenario, std::size_t rotors, const Places& places) {
  const Thrust& thrust = scenario.plant.thrust;
  for (std::size_t i = 0; i < thrust.failures.size(); ++i) {
    const ThrustFailure& failure = thrust.failures[i];
    const std::string path = "plant.thrust.failures[" + std::to_string(i) + "].";
    check_vehicle(failure.vehicle, path + "vehicle", scenario, places);
    if (failure.rotor && rotors == 0)
      throw places.make_error_at(path + "rotor",
                                 "of vehicles with rotors, here they are point masses");
    if (failure.rotor && *failure.rotor > static_cast<int>(rotors))
      throw places.make_error_at(path + "rotor", "expected a rotor from 1 to " +
                                                     std::to_string(rotors) + ", got " +
                                                     std::to_string(*failure.rotor));
  }
  if (!thrust.battery) return;
  const Battery& battery = *thrust.battery;
  if (battery.empty_v > battery.full_v)
    throw places.make_error_at("plant.thrust.battery.empty_v",
                               "expected at most full_v (" + to_text(battery.full_v) + "), got " +
                                   to_text(battery.empty_v));
  const double most = battery.empty_v * battery.empty_v / (4.0 * battery.hover_power_w);
  if (battery.resistance_ohm > most)
    throw places.make_error_at("plant.thrust.battery.resistance_ohm",
                               "expected at most " + to_text(most) +
                                   ", with which empty_v still gives hover_power_w, got " +
                                   to_text(battery.resistance_ohm));
}

/// Conditions on cable and load need a plant that has cables, and those on the ground a ground.
void check_conditions(const Scenario& scenario, const Places& places) {
  const auto& load = scenario.shared_load;
  for (std::size_t i = 0; i < scenario.mission.size(); ++i)
    for (const char* key : {"cable", "tension_above_n", "tension_below_n", "load"}) {
      const std::string path = to_stage_path(i) + ".until." + key;
      if (!places.has(path)) continue;
      if (!load)
        throw places.make_error_at(path,
                                   "of a load on cables (plant.model 'cables'), here it is '" +
                                       scenario.plant.model.name + "'");
      if (std::string_view(key) == "load" && !load->on_ground)
        throw places.make_error_at(path, "of a plant with a ground (plant.ground_z_m)");
    }
}

/// Moves the start and the references of the vehicle. Leave conditions are relative to the
/// reference, so they move too.
void shift(Scenario& scenario, const Eigen::Vector3d& offset) {
  scenario.plant.initial.position += offset;
  for (Stage& stage : scenario.mission) {
    if (auto* constant = std::get_if<ConstantReference>(&stage.reference))
      constant->position += offset;
    if (auto* eight = std::get_if<FigureEightReference>(&stage.reference)) eight->offset += offset;
    if (auto* rest = std::get_if<RestToRestReference>(&stage.reference)) {
      rest->from += offset;
      rest->to += offset;
    }
  }
}

}  // namespace

std::ifstream open_regular_file(const std::filesystem::path& file, const std::string& kind) {
  namespace fs = std::filesystem;
  const auto fail = [&](const std::string& found) {
    throw make_error(file.string(), 0, "", "expected " + kind + ", got " + found);
  };
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) fail("none (" + error.message() + ")");
  if (fs::is_directory(status)) fail("a directory");
  if (!fs::is_regular_file(status)) fail("a pipe, socket or device");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) fail("none that can be read (" + std::generic_category().message(errno) + ")");
  return stream;
}

std::string read_config_file(const std::filesystem::path& file, const std::string& kind,
                             std::size_t most) {
  std::ifstream stream = open_regular_file(file, kind);
  const auto size = static_cast<std::size_t>(stream.seekg(0, std::ios::end).tellg());
  if (size == 0 || size > most)
    throw make_error(file.string(), 0, "",
                     size == 0 ? "expected " + kind + ", got an empty file"
                               : "expected at most " + std::to_string(most) + " bytes, got " +
                                     std::to_string(size));
  std::string text(size, '\0');
  stream.seekg(0).read(text.data(), static_cast<std::streamsize>(size));
  if (!stream)
    throw make_error(file.string(), 0, "", "expected " + kind + ", got none that can be read");
  return text;
}

Scenario load_scenario(const std::filesystem::path& file, const Models& models) {
  Scenario scenario =
      parse_scenario(read_config_file(file, "a scenario file"), file.string(), models);
  scenario.folder = file.parent_path();
  return scenario;
}

Scenario parse_scenario(const std::string& text, const std::string& place, const Models& models) {
  check_size(text, place);
  return read_scenario(parse_yaml(text, place), place, text, models);
}

Scenario read_scenario(const YamlNode& root, const std::string& place, const std::string& text,
                       const Models& models) {
  check_size(text, place);
  Places places(place, models);
  places.add("", root.line);

  Scenario scenario;
  read_value(Value{root, "", root.line, places}, scenario);
  check_times(scenario, places);
  check_faults(scenario, places);
  check_autopilot(scenario, places);
  check_sensing(scenario, places);
  check_estimator(scenario, places);
  const auto& plant = find_model_keys(places.models().plants, scenario.plant.model);
  plant.check(scenario, places);
  scenario.shared_load = plant.calc_shared_load(scenario);
  check_step(scenario, places);
  check_wind(scenario, places);
  check_thrust(scenario, plant.calc_shape(scenario.plant).rotors.size(), places);
  check_attitudes(scenario, places);
  check_conditions(scenario, places);
  const auto& law = find_model_keys(places.models().laws, scenario.controller.law);
  law.check(scenario, places);
  if (const auto warning = law.find_warning(scenario, places))
    scenario.warnings.push_back(warning->what());
  scenario.text = text;
  scenario.sha256 = text::calc_sha256(text);
  return scenario;
}

std::filesystem::path find_plant_library(const Scenario& scenario) {
  // A plant in a library has no autopilot of ours.
  const bool is_autopilot = !scenario.plant.model.is_shared_library() && scenario.autopilot;
  const ModelName& model = is_autopilot ? scenario.autopilot->model : scenario.plant.model;
  return model.find_library(scenario.folder);
}

std::string to_yaml(const Scenario& scenario, const Models& models) {
  Scenario copy = scenario;  // one description serves reader and writer, so it takes no const
  std::string text;
  MapWriter writer(text, models);
  describe(writer, copy);
  return text;
}

std::vector<VehicleVariant> make_vehicle_grid(std::size_t count) {
  constexpr double kSpacing = 5.0;  // m; a figure eight of 1.5 m fits between neighbours
  std::size_t side = 1;
  while (side * side < count) ++side;
  std::vector<VehicleVariant> vehicles(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t row = i / side, column = i % side;
    vehicles[i].offset << static_cast<double>(column), static_cast<double>(row), 0.0;
    vehicles[i].offset *= kSpacing;
  }
  return vehicles;
}

Scenario make_vehicle_scenario(const Scenario& scenario, std::uint32_t id) {
  const VehicleVariant& variant = scenario.vehicles.at(id);
  Scenario alone = scenario;
  alone.vehicles.assign(1, VehicleVariant{});
  put_own(variant, alone.vehicle);
  InitialState& initial = alone.plant.initial;
  initial.has_own_velocity = variant.v_WQ.has_value();
  initial.v_WQ = variant.v_WQ.value_or(initial.v_WQ);
  alone.plant.thrust.scale = variant.thrust_scale.value_or(alone.plant.thrust.scale);
  if (variant.q_WB) initial.q_WB = variant.q_WB;
  if (variant.w_WB_B) initial.w_WB_B = variant.w_WB_B;
  ControllerModel& model = alone.controller.model;
  if (model.follows.quad_mass) model.vehicle.quad_mass = alone.vehicle.quad_mass;
  if (model.follows.load_mass) model.vehicle.load_mass = alone.vehicle.load_mass;
  if (model.follows.rod_length) model.vehicle.rod_length = alone.vehicle.rod_length;
  if (!variant.offset.isZero(0.0)) shift(alone, variant.offset);  // −0 + 0 would change a bit
  return alone;
}

void override_period(Scenario& scenario, double period_s) {
  const auto fail = [](const std::string& message) { throw ConfigError("--period-s: " + message); };
  const auto period = to_nanoseconds(period_s);
  if (!(period_s > 0.0)) fail("expected > 0, got " + to_text(period_s));
  if (period_s > kMaxSeconds) fail("expected at most 1000000 s, got " + to_text(period_s));
  if (!period || *period == 0)
    fail("expected a whole number of nanoseconds, got " + to_text(period_s));

  Scenario changed = scenario;
  changed.sync.period_ns = *period;
  changed.plant.step_ns = std::min(scenario.plant.step_ns, *period);
  if (*period % changed.plant.step_ns != 0)
    fail(to_mismatch("multiple", "plant.step_s", changed.plant.step_ns, *period));
  const std::int64_t autopilot_period = changed.autopilot ? changed.autopilot->period_ns : 0;
  if (autopilot_period % changed.plant.step_ns != 0)
    fail(to_mismatch("divisor", "autopilot.period_s", autopilot_period, changed.plant.step_ns));
  if (const auto index = find_stage_off_period(changed)) {
    const auto& leave = std::get<LeaveAfter>(changed.mission[*index].leave);
    fail(to_mismatch("divisor", to_stage_path(*index) + ".for_s", leave.duration_ns, *period));
  }
  if (const auto mismatch = find_delay_mismatch(changed)) {
    const std::string key = to_fault_path(changed, mismatch->fault) + ".by_s";
    if (!mismatch->is_too_long) fail(to_mismatch("divisor", key, mismatch->by_ns, *period));
    fail(key + ": expected " + to_too_long(*period) + ", got " + to_seconds_text(mismatch->by_ns));
  }
  if (const auto time = find_too_many_samples(changed))
    fail(std::string(time->key) + ": " + to_too_many(*time));
  scenario = std::move(changed);
}

void override_real_time_factor(Scenario& scenario, double factor) {
  if (scenario.sync.mode != SyncMode::kRealtime)
    throw ConfigError("--rtf: expected --mode realtime with it, got lockstep");
  if (!kRate.holds(factor))
    throw ConfigError(std::string("--rtf: expected ") + kRate.expectation + ", got " +
                      to_text(factor));
  scenario.sync.real_time_factor = factor;
}

}  // namespace sls::config
