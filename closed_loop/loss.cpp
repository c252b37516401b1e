#include "closed_loop/loss.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

#include "common/config/numbers.hpp"

namespace sls::closed_loop {

void ErrorHistory::add(const model::StepRecord& step, double error) {
  if (step.answer.stage >= stages_.size()) stages_.resize(step.answer.stage + 1);
  stages_[step.answer.stage].push_back(error);
}

double ErrorHistory::find(const model::StepRecord& step) const {
  if (step.answer.stage >= stages_.size() || stages_[step.answer.stage].empty()) return 0.0;
  const std::vector<double>& errors = stages_[step.answer.stage];
  const std::size_t since_start = step.step - step.answer.memory.stage_start_step;
  return errors[std::min(since_start, errors.size() - 1)];
}

void add_errors(const std::vector<model::StepRecord>& steps, FlightErrors& errors) {
  errors.resize(steps.size());
  for (std::size_t i = 0; i < steps.size(); ++i) errors[i].add(steps[i], calc_load_error(steps[i]));
}

LossRule::LossRule(const config::Scenario& scenario, const FlightErrors& base,
                   std::string comparison)
    : base_(base), comparison_(std::move(comparison)) {
  for (const config::VehicleVariant& vehicle : scenario.vehicles)
    rod_lengths_.push_back(vehicle.rod_length.value_or(scenario.vehicle.rod_length));
}

std::string LossRule::describe_loss(std::size_t vehicle) const {
  const std::string name = rod_lengths_.size() > 1 ? fmt::format("vehicle {}: ", vehicle) : "";
  return fmt::format("{}load more than {} m further from its reference than {}", name,
                     config::to_text(rod_lengths_[vehicle]), comparison_);
}

std::string describe_time(std::int64_t time_ns) {
  return fmt::format(", at {} s", config::to_text(config::to_seconds(time_ns)));
}

}  // namespace sls::closed_loop
