#include "closed_loop/batch.hpp"

#include <algorithm>
#include <exception>
#include <utility>
#include <variant>

#include "closed_loop/flight.hpp"

namespace sls::closed_loop {
namespace {

constexpr std::size_t kBlock = 32;  // loops that a thread takes at once: about 10 µs of work

void allocate(LoopStates& states, std::size_t count, bool has_attitude, std::size_t signals) {
  const auto rows = static_cast<Eigen::Index>(count);
  states.signals.setZero(rows, static_cast<Eigen::Index>(signals));
  for (auto* vectors :
       {&states.quad_position, &states.quad_velocity, &states.load_position, &states.load_velocity})
    vectors->setZero(rows, 3);
  states.angles.setZero(rows, 2);
  states.angle_rates.setZero(rows, 2);
  states.attitude.setZero(has_attitude ? rows : 0, 4);
  states.body_rates.setZero(has_attitude ? rows : 0, 3);
}

void write_row(LoopStates& states, Eigen::Index row, const model::Measurement& state) {
  states.quad_position.row(row) = state.p_WQ;
  states.quad_velocity.row(row) = state.v_WQ;
  states.load_position.row(row) = state.p_WL;
  states.load_velocity.row(row) = state.v_WL;
  states.angles.row(row) << state.rod.alpha, state.rod.beta;
  states.angle_rates.row(row) << state.rod.alpha_dot, state.rod.beta_dot;
  states.signals.row(row) = state.signals;
  if (states.attitude.rows() == 0) return;
  const Eigen::Quaterniond& q_WB = state.attitude.q_WB;
  states.attitude.row(row) << q_WB.w(), q_WB.x(), q_WB.y(), q_WB.z();
  states.body_rates.row(row) = state.attitude.w_WB_B;
}

void shift(config::DropFault& fault, std::uint64_t by) { fault.seed += by; }
void shift(config::ReorderFault& fault, std::uint64_t by) { fault.seed += by; }
void shift(config::NoiseFault& fault, std::uint64_t by) { fault.seed += by; }
template <class Other>
void shift(Other&, std::uint64_t) {}

}  // namespace

Batch::Batch(const config::Scenario& scenario, std::size_t count, const BatchOptions& options)
    : moves_together_(sim::find_plant_type(scenario.plant.model).moves == sim::Moves::kAllVehicles),
      ids_(moves_together_ ? list_vehicles(scenario) : std::vector{options.vehicle}),
      scenario_(moves_together_ ? scenario
                                : config::make_vehicle_scenario(scenario, options.vehicle)),
      own_(make_own(scenario_)),
      controller_name_(options.controller_name),
      steps_per_period_(scenario.sync.period_ns / scenario.plant.step_ns),
      steps_(count),
      times_(count),
      failed_(count),
      pool_(std::max<std::size_t>(options.threads, 1)) {
  if (moves_together_ && options.vehicle != 0)
    throw config::ConfigError("vehicle: expected 0, since the vehicles of '" + scenario.name +
                              "' move together, got " + std::to_string(options.vehicle));
  scenario_.text.clear();  // each loop is made from a copy
  const LoopStart start{scenario_.plant.initial};
  loops_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) loops_.push_back(make_loop(start));
  const sim::Plant& plant = *loops_[0].plant;
  has_attitude_ = plant.has_attitude();
  signals_ = plant.signals();
  for (const sim::FaultLine& faults : loops_[0].faults)
    has_state_faults_ = has_state_faults_ || faults.can_disturb_state();
  can_measurement_differ_ = has_state_faults_ || !plant.sees_truth();

  for (std::size_t i = 0; i < ids_.size(); ++i)
    missions_.emplace_back(own_[i].mission, scenario_.sync.period_ns,
                           control::find_cable_end(own_[i], ids_[i]));
  std::int64_t start_ns = 0;
  for (const config::Stage& stage : scenario_.mission) {
    stage_starts_ns_.push_back(start_ns);
    const auto* leave = std::get_if<config::LeaveAfter>(&stage.leave);
    if (!leave) break;
    // The stage ends at the first step at or after its duration.
    const std::int64_t period_ns = scenario_.sync.period_ns;
    start_ns += (leave->duration_ns + period_ns - 1) / period_ns * period_ns;
  }

  const std::size_t rows = count * ids_.size();
  allocate(truth_, rows, has_attitude_, signals_.size());
  if (can_measurement_differ_) allocate(measured_, rows, has_attitude_, signals_.size());
  for (std::size_t i = 0; i < count; ++i) show(i);
}

/// The scenario of each vehicle alone.
std::vector<config::Scenario> Batch::make_own(const config::Scenario& scenario) const {
  if (!moves_together_) return {scenario};
  std::vector<config::Scenario> own;
  for (const std::uint32_t id : ids_) own.push_back(config::make_vehicle_scenario(scenario, id));
  return own;
}

Batch::Loop Batch::make_loop(const LoopStart& start) const {
  config::Scenario changed = scenario_;
  changed.plant.initial = start.initial;
  for (config::Fault& fault : changed.faults)
    std::visit([&](auto& effect) { shift(effect, start.seed_shift); }, fault.effect);
  const sim::PlantType& type = sim::find_plant_type(changed.plant.model);
  Loop loop;
  loop.plant = moves_together_ ? std::move(sim::make_plants(type, changed, ids_)[0].plant)
                               : sim::make_plant(type, changed, ids_[0]);
  const std::vector<config::Scenario> own = make_own(changed);
  for (std::size_t i = 0; i < ids_.size(); ++i) loop.faults.emplace_back(own[i], ids_[i]);
  loop.forces.resize(ids_.size());
  return loop;
}

void Batch::reset(const std::vector<std::size_t>& which, const std::vector<LoopStart>& starts) {
  std::vector<Loop> loops;
  loops.reserve(which.size());
  for (const LoopStart& start : starts) {
    if (!has_attitude_ && (start.initial.q_WB || start.initial.w_WB_B))
      throw config::ConfigError(
          "attitude, body_rates: expected a plant whose vehicles turn, got '" +
          scenario_.plant.model.name + "'");
    if (moves_together_) {  // reading a scenario applies the plant's rules for its start
      config::Scenario changed = scenario_;
      changed.plant.initial = start.initial;
      config::parse_scenario(config::to_yaml(changed), "reset");
    }
    loops.push_back(make_loop(start));
  }
  for (std::size_t k = 0; k < which.size(); ++k) {
    const std::size_t i = which[k];
    loops_[i] = std::move(loops[k]);
    steps_[i] = 0;
    times_[i] = 0.0;
    failed_[i] = 0;
    show(i);
  }
}

void Batch::step(const double* forces) {
  const std::size_t blocks = (loops_.size() + kBlock - 1) / kBlock;
  pool_.for_each(blocks, [&](std::size_t block) {
    const std::size_t end = std::min((block + 1) * kBlock, loops_.size());
    for (std::size_t i = block * kBlock; i < end; ++i)
      if (!failed_[i]) move(i, forces + 3 * ids_.size() * i);
  });
}

void Batch::answer(double* forces) {
  if (controllers_.empty())
    for (std::size_t i = 0; i < ids_.size(); ++i) controllers_.emplace_back(own_[i], ids_[i]);
  const sim::AnswerLimits limits = sim::make_answer_limits(scenario_);
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    if (!failed_[i] && loops_[i].answered != steps_[i]) answer(i, limits);
    for (std::size_t k = 0; k < ids_.size(); ++k, forces += 3)
      Eigen::Map<Eigen::Vector3d>{forces} =
          failed_[i] ? Eigen::Vector3d::Zero() : loops_[i].answers[k].f_Q_W;
  }
}

void Batch::answer(std::size_t index, const sim::AnswerLimits& limits) {
  Loop& loop = loops_[index];
  loop.answers.resize(ids_.size());
  loop.answered = steps_[index];
  try {
    for (std::size_t k = 0; k < ids_.size(); ++k)
      loop.answers[k] = controllers_[k].calc_answer(
          steps_[index], can_measurement_differ_ ? loop.seen[k] : loop.plant->measurement(k),
          loop.answers[k].memory);
  } catch (const std::exception& error) {
    return fail(index, error.what());
  }
  for (std::size_t k = 0; k < ids_.size(); ++k)
    if (!accepts(index, k, loop.answers[k], limits)) return;
}

bool Batch::accepts(std::size_t index, std::size_t vehicle, const model::Answer& answer,
                    const sim::AnswerLimits& limits) {
  const auto defect = sim::find_defect(steps_[index], answer, limits);
  if (!defect) return true;
  fail(index, (ids_.size() > 1 ? "vehicle " + std::to_string(vehicle) + ": " : std::string()) +
                  sim::describe_refusal(*defect, steps_[index], answer, limits, controller_name_));
  return false;
}

void Batch::move(std::size_t index, const double* forces) {
  Loop& loop = loops_[index];
  const sim::AnswerLimits limits{scenario_.controller.force_limit_n};  // the caller has no mission
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    model::Answer answer;
    answer.f_Q_W = loop.forces[k] = Eigen::Map<const Eigen::Vector3d>(forces + 3 * k);
    if (!accepts(index, k, answer, limits)) return;
  }
  for (std::size_t k = 0; k < ids_.size(); ++k)
    loop.forces[k] = loop.faults[k].actuate(steps_[index], loop.forces[k]);
  try {
    loop.plant->advance(loop.forces, steps_per_period_);
  } catch (const std::exception& error) {
    return fail(index, error.what());
  }
  ++steps_[index];
  times_[index] =
      static_cast<double>(static_cast<std::int64_t>(steps_[index]) * scenario_.sync.period_ns) /
      1e9;
  show(index);
}

void Batch::show(std::size_t index) {
  Loop& loop = loops_[index];
  if (can_measurement_differ_) loop.seen.resize(ids_.size());
  auto row = static_cast<Eigen::Index>(index * ids_.size());
  for (std::size_t k = 0; k < ids_.size(); ++k, ++row) {
    write_row(truth_, row, loop.plant->measurement(k));
    if (!can_measurement_differ_) continue;
    const model::Measurement& seen = loop.plant->seen(k);
    loop.seen[k] = has_state_faults_ ? loop.faults[k].measure(steps_[index], seen) : seen;
    write_row(measured_, row, loop.seen[k]);
  }
}

void Batch::fail(std::size_t index, const std::string& reason) {
  loops_[index].failure = reason;
  failed_[index] = 1;
}

model::Reference Batch::calc_reference(std::int64_t time_ns, std::size_t vehicle) const {
  const auto next =
      std::upper_bound(stage_starts_ns_.begin() + 1, stage_starts_ns_.end(), time_ns) - 1;
  return missions_[vehicle].calc_reference(
      static_cast<std::uint32_t>(next - stage_starts_ns_.begin()),
      static_cast<double>(time_ns - *next) / 1e9);
}

}  // namespace sls::closed_loop
