#include "closed_loop/loss.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

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

std::string describe_loss(double rod_length, const std::string& comparison) {
  return fmt::format("load more than {} m further from its reference than {}",
                     config::to_text(rod_length), comparison);
}

std::string describe_time(std::int64_t time_ns) {
  return fmt::format(", at {} s", config::to_text(config::to_seconds(time_ns)));
}

}  // namespace sls::closed_loop
