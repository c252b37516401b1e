#include "closed_loop/batch.hpp"

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <utility>
#include <variant>

#include "sim_server/core/judgement.hpp"

namespace sls::closed_loop {
namespace {

constexpr std::size_t kBlock = 32;  // loops that a thread takes at once: about 10 µs of work

void allocate(LoopStates& states, std::size_t count, bool has_attitude) {
  const auto rows = static_cast<Eigen::Index>(count);
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
    : scenario_(config::make_vehicle_scenario(scenario, options.vehicle)),
      vehicle_(options.vehicle),
      controller_name_(options.controller_name),
      steps_per_period_(scenario.sync.period_ns / scenario.plant.step_ns),
      steps_(count),
      times_(count),
      failed_(count),
      pool_(std::max<std::size_t>(options.threads, 1)) {
  scenario_.text.clear();  // each loop is made from a copy
  // Also refuses a plant that moves the whole fleet together.
  const auto plants =
      sim::make_plants(sim::find_plant_type(scenario.plant.model), scenario, {vehicle_});
  has_attitude_ = plants[0].plant->has_attitude();
  has_state_faults_ = sim::FaultLine(scenario_, vehicle_).can_disturb_state();
  can_measurement_differ_ = has_state_faults_ || !plants[0].plant->sees_truth();

  std::int64_t start_ns = 0;
  for (const config::Stage& stage : scenario_.mission) {
    stages_.push_back({start_ns, control::make_reference_trajectory(stage.reference)});
    const auto* leave = std::get_if<config::LeaveAfter>(&stage.leave);
    if (!leave) break;
    // The stage ends at the first step at or after its duration.
    const std::int64_t period_ns = scenario_.sync.period_ns;
    start_ns += (leave->duration_ns + period_ns - 1) / period_ns * period_ns;
  }

  allocate(truth_, count, has_attitude_);
  if (can_measurement_differ_) allocate(measured_, count, has_attitude_);
  const LoopStart start{scenario_.plant.initial};
  loops_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    loops_.push_back(make_loop(start));
    show(i);
  }
}

Batch::Loop Batch::make_loop(const LoopStart& start) const {
  config::Scenario alone = scenario_;
  alone.plant.initial = start.initial;
  for (config::Fault& fault : alone.faults)
    std::visit([&](auto& effect) { shift(effect, start.seed_shift); }, fault.effect);
  return {sim::make_plant(sim::find_plant_type(alone.plant.model), alone, vehicle_),
          std::make_unique<sim::FaultLine>(alone, vehicle_),
          std::vector<Eigen::Vector3d>(1),
          {}};
}

void Batch::reset(const std::vector<std::size_t>& which, const std::vector<LoopStart>& starts) {
  std::vector<Loop> loops;
  loops.reserve(which.size());
  for (const LoopStart& start : starts) {
    if (!has_attitude_ && (start.initial.q_WB || start.initial.w_WB_B))
      throw config::ConfigError(
          "attitude, body_rates: expected a plant whose vehicles turn, got '" +
          scenario_.plant.model.name + "'");
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
      if (!failed_[i]) move(i, Eigen::Map<const Eigen::Vector3d>(forces + 3 * i));
  });
}

void Batch::move(std::size_t index, const Eigen::Vector3d& f_Q_W) {
  Loop& loop = loops_[index];
  model::Answer answer;
  answer.f_Q_W = f_Q_W;
  const sim::AnswerLimits limits{scenario_.controller.force_limit_n};  // a batch has no mission
  if (const auto defect = sim::find_defect(steps_[index], answer, limits))
    return fail(index,
                sim::describe_refusal(*defect, steps_[index], answer, limits, controller_name_));
  loop.force[0] = loop.faults->actuate(steps_[index], f_Q_W);
  try {
    loop.plant->advance(loop.force, steps_per_period_);
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
  const auto row = static_cast<Eigen::Index>(index);
  write_row(truth_, row, loop.plant->measurement(0));
  if (!can_measurement_differ_) return;
  const model::Measurement& seen = loop.plant->seen(0);
  if (has_state_faults_)
    write_row(measured_, row, loop.faults->measure(steps_[index], seen));
  else
    write_row(measured_, row, seen);
}

void Batch::fail(std::size_t index, const std::string& reason) {
  loops_[index].failure = reason;
  failed_[index] = 1;
}

model::Reference Batch::calc_reference(std::int64_t time_ns) const {
  const auto next = std::upper_bound(
      stages_.begin() + 1, stages_.end(), time_ns,
      [](std::int64_t time, const StageSpan& stage) { return time < stage.start_ns; });
  const StageSpan& stage = *(next - 1);
  return stage.trajectory->calc(static_cast<double>(time_ns - stage.start_ns) / 1e9);
}

}  // namespace sls::closed_loop
