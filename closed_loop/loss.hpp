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

/// True if the load error `error` is more than one rod length (m) larger than in the flight `base`.
inline bool is_load_lost(const model::StepRecord& step, double error, const ErrorHistory& base,
                         double rod_length) {
  return error - base.find(step) > rod_length;
}

/// A text for such a loss; `comparison` completes "further from its reference than …".
std::string describe_loss(double rod_length, const std::string& comparison);

/// Time of the last of `steps` answered steps, ns: when a flight ended or lost its load.
inline std::int64_t calc_last_time_ns(std::uint64_t steps, std::int64_t period_ns) {
  return (static_cast<std::int64_t>(steps) - 1) * period_ns;
}

/// `, at X s`.
std::string describe_time(std::int64_t time_ns);

}  // namespace sls::closed_loop
