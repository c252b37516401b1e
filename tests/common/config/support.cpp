#include "tests/common/config/support.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace sls::config::test {
namespace {

bool are_equal(const InitialState& a, const InitialState& b) {
  return a.placed == b.placed && a.position == b.position && a.v_WQ == b.v_WQ &&
         a.rod.alpha == b.rod.alpha && a.rod.beta == b.rod.beta &&
         a.rod.alpha_dot == b.rod.alpha_dot && a.rod.beta_dot == b.rod.beta_dot &&
         a.q_WB.has_value() == b.q_WB.has_value() &&
         (!a.q_WB || a.q_WB->coeffs() == b.q_WB->coeffs()) && a.w_WB_B == b.w_WB_B;
}

bool are_equal(const Plant& a, const Plant& b) {
  return a.model.name == b.model.name &&
         a.own.get<sim::SlungLoadKeys>().pendulum == b.own.get<sim::SlungLoadKeys>().pendulum &&
         a.step_ns == b.step_ns && are_equal(a.initial, b.initial) && a.air == b.air &&
         a.disturbance_W == b.disturbance_W;
}

bool are_equal(const std::optional<Autopilot>& a, const std::optional<Autopilot>& b) {
  if (a.has_value() != b.has_value()) return false;
  return !a || (a->model.name == b->model.name && a->period_ns == b->period_ns);
}

template <class Policy>
bool are_equal(const Absence<Policy>& a, const Absence<Policy>& b) {
  return a.policy == b.policy && a.deadline_s == b.deadline_s;
}

bool are_equal(const Sync& a, const Sync& b) {
  return a.mode == b.mode && a.period_ns == b.period_ns &&
         a.real_time_factor == b.real_time_factor && a.take_over_s == b.take_over_s &&
         a.wait_for.controllers == b.wait_for.controllers &&
         a.wait_for.recorders == b.wait_for.recorders &&
         a.wait_for.timeout_s == b.wait_for.timeout_s && a.max_hold_s == b.max_hold_s &&
         are_equal(a.wait.controller, b.wait.controller) &&
         are_equal(a.wait.recorder, b.wait.recorder) &&
         a.wait.server_deadline_s == b.wait.server_deadline_s;
}

bool are_equal(const AxisGains& a, const AxisGains& b) {
  return a.position == b.position && a.velocity == b.velocity && a.acceleration == b.acceleration &&
         a.jerk == b.jerk && a.integral == b.integral;
}

bool are_equal(const Gains& a, const Gains& b) {
  if (a.index() != b.index()) return false;
  if (const auto* weights = std::get_if<LqrWeights>(&a)) {
    const auto& other = std::get<LqrWeights>(b);
    return weights->horizontal == other.horizontal && weights->vertical == other.vertical;
  }
  const auto &named = std::get<NamedGains>(a), &other = std::get<NamedGains>(b);
  return are_equal(named.horizontal, other.horizontal) && are_equal(named.vertical, other.vertical);
}

bool are_equal(const VehicleVariant& a, const VehicleVariant& b) {
  return a.offset == b.offset && a.quad_mass == b.quad_mass && a.load_mass == b.load_mass &&
         a.rod_length == b.rod_length;
}

bool are_equal(const ControllerModel& a, const ControllerModel& b) {
  return a.vehicle == b.vehicle && a.air == b.air && a.follows.quad_mass == b.follows.quad_mass &&
         a.follows.load_mass == b.follows.load_mass && a.follows.rod_length == b.follows.rod_length;
}

bool are_equal(const Controller& a, const Controller& b) {
  return a.law.name == b.law.name &&
         are_equal(a.own.get<QsfKeys>().gains, b.own.get<QsfKeys>().gains) &&
         a.force_limit_n == b.force_limit_n && a.saturate == b.saturate &&
         a.drag_feed_forward == b.drag_feed_forward && a.state_wiring == b.state_wiring &&
         are_equal(a.model, b.model);
}

bool are_equal(const StageReference& a, const StageReference& b) {
  if (a.index() != b.index()) return false;
  if (const auto* constant = std::get_if<ConstantReference>(&a))
    return constant->position == std::get<ConstantReference>(b).position;
  if (const auto* eight = std::get_if<FigureEightReference>(&a)) {
    const auto& other = std::get<FigureEightReference>(b);
    return eight->amplitude == other.amplitude && eight->offset == other.offset &&
           eight->period_s == other.period_s;
  }
  const auto &rest = std::get<RestToRestReference>(a), &other = std::get<RestToRestReference>(b);
  return rest.from == other.from && rest.to == other.to && rest.duration_s == other.duration_s;
}

bool are_equal(const LeaveCondition& a, const LeaveCondition& b) {
  if (a.index() != b.index()) return false;
  if (const auto* timed = std::get_if<LeaveAfter>(&a))
    return timed->duration_ns == std::get<LeaveAfter>(b).duration_ns;
  const auto &within = std::get<LeaveUntil>(a), &other = std::get<LeaveUntil>(b);
  return within.condition == other.condition && within.cable == other.cable &&
         within.load == other.load && within.tension_n == other.tension_n &&
         within.after_ns == other.after_ns && within.radius_m == other.radius_m &&
         within.body == other.body && within.offset == other.offset &&
         within.timeout_ns == other.timeout_ns;
}

bool are_equal(const Stage& a, const Stage& b) {
  return a.kind == b.kind && a.name == b.name && are_equal(a.reference, b.reference) &&
         are_equal(a.leave, b.leave);
}

bool are_equal(const model::RodAngles& a, const model::RodAngles& b) {
  return a.alpha == b.alpha && a.beta == b.beta && a.alpha_dot == b.alpha_dot &&
         a.beta_dot == b.beta_dot;
}

bool are_equal(const SampleOffset& a, const SampleOffset& b) {
  return a.position == b.position && a.velocity == b.velocity && are_equal(a.rod, b.rod) &&
         a.force == b.force;
}

bool are_equal(const Sensing& a, const Sensing& b) {
  return a.body.period_ns == b.body.period_ns && a.body.age_ns == b.body.age_ns &&
         a.rod.period_ns == b.rod.period_ns && a.rod.age_ns == b.rod.age_ns &&
         a.node_delay_ns == b.node_delay_ns;
}

bool are_equal(const Estimator& a, const Estimator& b) {
  return a.position == b.position && a.velocity == b.velocity &&
         a.attitude.tilt == b.attitude.tilt && a.attitude.yaw == b.attitude.yaw;
}

bool are_equal(const DelayFault& a, const DelayFault& b) { return a.by_ns == b.by_ns; }
bool are_equal(const DropFault& a, const DropFault& b) {
  return a.probability == b.probability && a.seed == b.seed;
}
bool are_equal(const FreezeFault&, const FreezeFault&) { return true; }
bool are_equal(const ReorderFault& a, const ReorderFault& b) {
  return a.probability == b.probability && a.seed == b.seed;
}
bool are_equal(const BiasFault& a, const BiasFault& b) { return are_equal(a.offset, b.offset); }
bool are_equal(const NoiseFault& a, const NoiseFault& b) {
  return are_equal(a.deviation, b.deviation) && a.seed == b.seed;
}

bool are_equal(const Fault& a, const Fault& b) {
  if (a.effect.index() != b.effect.index()) return false;
  const bool same_effect = std::visit(
      [&](const auto& effect) {
        return are_equal(effect, std::get<std::decay_t<decltype(effect)>>(b.effect));
      },
      a.effect);
  return same_effect && a.kind == b.kind && a.on == b.on && a.vehicle == b.vehicle &&
         a.from_ns == b.from_ns && a.to_ns == b.to_ns;
}

/// Random numbers of every size, most of them with all their digits in use.
class Dice {
 public:
  explicit Dice(std::mt19937_64& random) : random_(random) {}

  int roll(int least, int most) { return std::uniform_int_distribution<int>(least, most)(random_); }
  bool toss() { return roll(0, 1) == 1; }
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double positive() { return between(1.0, 10.0) * std::pow(10.0, roll(-12, 12)); }
  double any() { return roll(0, 5) == 0 ? 0.0 : (toss() ? positive() : -positive()); }
  Eigen::Vector3d vector() { return {any(), any(), any()}; }
  std::int64_t nanoseconds(std::int64_t least, std::int64_t most) {
    return std::uniform_int_distribution<std::int64_t>(least, most)(random_);
  }
  std::string text(const std::string& alphabet, int longest) {
    std::string text;
    for (int left = roll(1, longest); left > 0; --left)
      text += alphabet[static_cast<std::size_t>(roll(0, static_cast<int>(alphabet.size()) - 1))];
    return text;
  }

 private:
  std::mt19937_64& random_;
};

model::SlungLoadParameters make_random_vehicle(Dice& dice) {
  model::SlungLoadParameters vehicle;
  vehicle.quad_mass = dice.positive();
  vehicle.load_mass = dice.positive();
  vehicle.rod_length = dice.positive();
  vehicle.gravity = dice.positive();
  return vehicle;
}

model::Aerodynamics make_random_air(Dice& dice) {
  return {dice.toss() ? 0.0 : dice.positive(), dice.vector()};
}

Plant make_random_plant(Dice& dice) {
  Plant plant;
  plant.step_ns = dice.nanoseconds(1, 10'000'000);
  plant.initial.placed = dice.toss() ? Body::kLoad : Body::kQuadrotor;
  plant.initial.position = dice.vector();
  plant.initial.v_WQ = dice.vector();
  plant.initial.rod = {dice.between(-3.14, 3.14), dice.between(-1.57, 1.57), dice.any(),
                       dice.any()};
  plant.air = make_random_air(dice);
  plant.disturbance_W = dice.vector();
  return plant;
}

Sync make_random_sync(Dice& dice, std::int64_t step_ns) {
  Sync sync;
  sync.mode = dice.toss() ? SyncMode::kLockstep : SyncMode::kRealtime;
  sync.period_ns = step_ns * dice.roll(1, 20);
  sync.real_time_factor = dice.between(0.001, 1000.0);
  sync.take_over_s = dice.between(1e-3, 10.0);
  sync.wait_for.controllers = dice.roll(1, 100);
  sync.wait_for.recorders = dice.roll(0, 100);
  sync.wait_for.timeout_s = dice.between(1e-3, 1e6);
  sync.max_hold_s = dice.toss() ? 0.0 : dice.positive();
  sync.wait.controller.policy = static_cast<ControllerPolicy>(dice.roll(0, 3));
  sync.wait.controller.deadline_s = dice.between(1e-3, 1e6);
  sync.wait.recorder.policy = static_cast<RecorderPolicy>(dice.roll(0, 2));
  sync.wait.recorder.deadline_s = dice.between(1e-3, 1e6);
  sync.wait.server_deadline_s = dice.between(1e-3, 1e6);
  return sync;
}

Gains make_random_gains(Dice& dice) {
  if (dice.toss()) return LqrWeights{dice.positive(), dice.positive()};
  NamedGains gains;
  gains.horizontal = {dice.positive(), dice.positive(), dice.positive(), dice.positive(),
                      dice.toss() ? 0.0 : dice.positive()};
  gains.vertical.position = dice.positive();
  gains.vertical.velocity = dice.positive();
  gains.vertical.integral = dice.toss() ? 0.0 : dice.positive();
  return gains;
}

Controller make_random_controller(Dice& dice) {
  Controller controller;
  controller.own = QsfKeys{make_random_gains(dice)};
  controller.force_limit_n = dice.positive();
  controller.saturate = dice.toss();
  controller.drag_feed_forward = dice.toss();
  controller.state_wiring = dice.toss() ? StateWiring::kCorrect : StateWiring::kGazeboPlugin;
  controller.model = {make_random_vehicle(dice), make_random_air(dice), {}};
  return controller;
}

Stage make_random_stage(Dice& dice, std::int64_t period_ns) {
  static const char* const kKinds[] = {"hold", "set_point", "figure_eight", "rest_to_rest"};
  std::string printable;
  for (char c = ' '; c <= '~'; ++c) printable += c;

  Stage stage;
  const int kind = dice.roll(0, 3);
  stage.kind = kKinds[kind];
  stage.name = dice.text(printable, 32);
  if (kind <= 1)
    stage.reference = ConstantReference{dice.vector()};
  else if (kind == 2)
    stage.reference = FigureEightReference{dice.vector(), dice.vector(), dice.positive()};
  else
    stage.reference = RestToRestReference{dice.vector(), dice.vector(), dice.positive()};
  if (dice.toss()) {
    stage.leave = LeaveAfter{period_ns * dice.nanoseconds(1, 1'000'000)};
  } else {
    LeaveUntil leave;
    leave.after_ns = dice.toss() ? 0 : dice.nanoseconds(1, 400'000'000'000'000);
    leave.radius_m = dice.positive();
    leave.body = dice.toss() ? Body::kLoad : Body::kQuadrotor;
    leave.offset = dice.vector();
    leave.timeout_ns = leave.after_ns + dice.nanoseconds(1, 400'000'000'000'000);
    stage.leave = leave;
  }
  return stage;
}

/// Numbers for the keys that `on` allows, some of them 0. Without `is_signed` they are standard
/// deviations.
SampleOffset make_random_offset(Dice& dice, FaultChannel on, bool is_signed) {
  const auto number = [&] { return is_signed ? dice.any() : std::abs(dice.any()); };
  const auto angle = [&] { return is_signed ? dice.between(-1.57, 1.57) : dice.between(0, 1.57); };
  const auto vector = [&]() -> Eigen::Vector3d { return {dice.positive(), number(), number()}; };
  SampleOffset offset;
  if (on == FaultChannel::kCommand) {
    offset.force = vector();
    return offset;
  }
  if (dice.toss()) offset.velocity = vector();
  if (dice.toss()) offset.position = vector();
  offset.rod = {angle(), dice.toss() ? 0.0 : angle(), number(), dice.positive()};
  return offset;
}

/// Ages and delays are at most one control period: every flight is long enough for them.
Sensing make_random_sensing(Dice& dice, std::int64_t period_ns) {
  const auto times = [&](std::int64_t longest) {
    return dice.toss() ? 0 : dice.nanoseconds(1, longest);
  };
  return {{times(1'000'000'000), times(period_ns)},
          {times(1'000'000'000), times(period_ns)},
          times(period_ns)};
}

VehicleVariant make_random_variant(Dice& dice) {
  VehicleVariant variant;
  if (dice.toss()) variant.offset = dice.vector();
  if (dice.toss()) variant.quad_mass = dice.positive();
  if (dice.toss()) variant.load_mass = dice.positive();
  if (dice.toss()) variant.rod_length = dice.positive();
  return variant;
}

/// Leaves out some keys of the model at random; their values then equal the plant's.
void follow_at_random(Dice& dice, ControllerModel& model, const model::SlungLoadParameters& truth) {
  model.follows = {dice.toss(), dice.toss(), dice.toss()};
  if (model.follows.quad_mass) model.vehicle.quad_mass = truth.quad_mass;
  if (model.follows.load_mass) model.vehicle.load_mass = truth.load_mass;
  if (model.follows.rod_length) model.vehicle.rod_length = truth.rod_length;
}

Fault make_random_fault(Dice& dice, std::int64_t period_ns, std::size_t vehicles) {
  static const char* const kKinds[] = {"delay", "drop", "freeze", "reorder", "bias", "noise"};
  const auto seed = [&] { return static_cast<std::uint64_t>(dice.nanoseconds(0, INT64_MAX)); };
  Fault fault;
  const int kind = dice.roll(0, 5);
  fault.kind = kKinds[kind];
  fault.on = dice.toss() ? FaultChannel::kState : FaultChannel::kCommand;
  fault.vehicle = dice.roll(0, static_cast<int>(vehicles) - 1);
  if (kind == 0) fault.effect = DelayFault{period_ns * dice.roll(0, 10'000)};
  if (kind == 1) fault.effect = DropFault{dice.between(0.0, 1.0), seed()};
  if (kind == 2) fault.effect = FreezeFault{};
  if (kind == 3) fault.effect = ReorderFault{dice.between(0.0, 1.0), seed()};
  if (kind == 4) fault.effect = BiasFault{make_random_offset(dice, fault.on, true)};
  if (kind == 5) fault.effect = NoiseFault{make_random_offset(dice, fault.on, false), seed()};
  if (dice.toss()) fault.from_ns = dice.nanoseconds(1, 400'000'000'000'000);
  if (dice.toss()) fault.to_ns = fault.from_ns + dice.nanoseconds(1, 400'000'000'000'000);
  return fault;
}

}  // namespace

const char* const kMinimalScenario =
    "name: minimal\n"
    "vehicle:\n"
    "  quad_mass_kg: 1.5\n"
    "  load_mass_kg: 0.2\n"
    "  rod_length_m: 1.0\n"
    "  gravity_m_s2: 9.8\n"
    "plant:\n"
    "  initial: { load_position_m: [0, 0, -0.5] }\n"
    "mission:\n"
    "  - hold: { position_m: [0, 0, -0.5] }\n"
    "    for_s: 2\n";

bool are_equal(const Scenario& a, const Scenario& b) {
  return a.name == b.name && a.vehicle == b.vehicle &&
         std::equal(
             a.vehicles.begin(), a.vehicles.end(), b.vehicles.begin(), b.vehicles.end(),
             [](const VehicleVariant& x, const VehicleVariant& y) { return are_equal(x, y); }) &&
         are_equal(a.plant, b.plant) && are_equal(a.autopilot, b.autopilot) &&
         are_equal(a.sync, b.sync) && are_equal(a.controller, b.controller) &&
         std::equal(a.mission.begin(), a.mission.end(), b.mission.begin(), b.mission.end(),
                    [](const Stage& x, const Stage& y) { return are_equal(x, y); }) &&
         std::equal(a.faults.begin(), a.faults.end(), b.faults.begin(), b.faults.end(),
                    [](const Fault& x, const Fault& y) { return are_equal(x, y); }) &&
         are_equal(a.sensing, b.sensing) && are_equal(a.estimator, b.estimator) &&
         a.record.flush_s == b.record.flush_s && a.record.formats == b.record.formats;
}

Scenario make_random_scenario(std::mt19937_64& random) {
  Dice dice(random);
  Scenario scenario;
  scenario.name = "s" + dice.text("abcXYZ019_.-", 63);
  scenario.vehicle = make_random_vehicle(dice);
  scenario.plant = make_random_plant(dice);
  scenario.sync = make_random_sync(dice, scenario.plant.step_ns);
  scenario.controller = make_random_controller(dice);
  for (int left = dice.roll(1, 12); left > 0; --left)
    scenario.mission.push_back(make_random_stage(dice, scenario.sync.period_ns));
  scenario.vehicles.resize(static_cast<std::size_t>(dice.roll(1, 5)));
  for (VehicleVariant& variant : scenario.vehicles) variant = make_random_variant(dice);
  for (int left = dice.roll(0, 9); left > 0; --left)
    scenario.faults.push_back(
        make_random_fault(dice, scenario.sync.period_ns, scenario.vehicles.size()));
  scenario.sensing = make_random_sensing(dice, scenario.sync.period_ns);
  if (dice.toss()) scenario.estimator.position = dice.vector();
  if (dice.toss()) scenario.estimator.velocity = dice.vector();
  scenario.record.flush_s = dice.between(1e-6, 0.2);
  if (dice.toss()) scenario.record.formats = {RecordFormat::kMcap, RecordFormat::kCsv};
  if (dice.roll(0, 4) == 0) {
    scenario.plant.own = sim::SlungLoadKeys{sim::Pendulum::kRigid};
    scenario.vehicle = {1.5, dice.toss() ? 0.2 : 0.201, 1.1, dice.positive()};
    scenario.vehicles = make_vehicle_grid(scenario.vehicles.size());
  }
  follow_at_random(dice, scenario.controller.model, scenario.vehicle);
  return scenario;
}

std::string find_error(const std::string& text) {
  try {
    parse_scenario(text, "file");
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

std::vector<std::filesystem::path> list_yaml_files(const std::string& folder) {
  std::vector<std::filesystem::path> files;
  const std::filesystem::path root = SLS_SOURCE_DIR;
  for (const auto& entry : std::filesystem::directory_iterator(root / folder))
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

}  // namespace sls::config::test
