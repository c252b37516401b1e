/// Loss of the load: the rule that delay margins and campaigns use. Definition: README.md.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "closed_loop/flight.hpp"

namespace sls::closed_loop {

/// Distance of the load from its reference, m.
inline double calc_load_error(const model::StepRecord& step) {
  return (step.truth.p_WL - step.answer.reference.position).norm();
}

/// The load errors of the flight with which others are compared, by stage and step in the stage.
/// Another flight can leave a stage at another step, so it is compared at the same time since the
/// start of the stage.
class ErrorHistory {
 public:
  void add(const model::StepRecord& step, double error);

  /// The error at the same stage and time as `step`; the last one of the stage if the stage was
  /// shorter; 0 if the stage was never flown.
  double find(const model::StepRecord& step) const;

 private:
  std::vector<std::vector<double>> stages_;
};

/// The histories of all vehicles of a flight, by id.
using FlightErrors = std::vector<ErrorHistory>;

/// Adds a step of all vehicles.
void add_errors(const std::vector<model::StepRecord>& steps, FlightErrors& errors);

/// A load is lost if its error is more than one rod length larger than in the flight `base`.
class LossRule {
 public:
  /// For all vehicles of `scenario`, as many as in `base`, which must outlive the rule.
  /// `comparison` completes "further from its reference than …".
  LossRule(const config::Scenario& scenario, const FlightErrors& base, std::string comparison);

  /// Why a load is lost at this step of all vehicles; empty if none is.
  std::string judge(const std::vector<model::StepRecord>& steps) const {
    for (std::size_t i = 0; i < steps.size(); ++i)
      if (calc_load_error(steps[i]) - base_[i].find(steps[i]) > rod_lengths_[i])
        return describe_loss(i);
    return {};
  }

 private:
  std::string describe_loss(std::size_t vehicle) const;

  const FlightErrors& base_;
  const std::string comparison_;
  std::vector<double> rod_lengths_;  // of each vehicle, m
};

/// Time of the last of `steps` answered steps, ns: when a flight ended or lost its load.
inline std::int64_t calc_last_time_ns(std::uint64_t steps, std::int64_t period_ns) {
  return (static_cast<std::int64_t>(steps) - 1) * period_ns;
}

/// `, at X s`.
std::string describe_time(std::int64_t time_ns);

}  // namespace sls::closed_loop
