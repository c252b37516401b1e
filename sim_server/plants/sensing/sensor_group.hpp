/// Sensors that sample together: README.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim_server/plants/plant.hpp"
#include "sim_server/plants/sensing/delay_line.hpp"
#include "sim_server/plants/sensing/sample_clock.hpp"

namespace sls::sim {

/// A group of sensors, with the samples of every vehicle that it can still show.
template <class Sample>
class SensorGroup {
 public:
  SensorGroup(const SampleClock& clock, const Plant& plant, std::size_t vehicles)
      : clock_(clock), lines_(vehicles), next_step_(clock.find_next_sample(0)) {
    if (next_step_ != SampleClock::kNever) put(plant, 0);
  }

  /// The step of the next sample.
  std::int64_t next_step() const { return next_step_; }

  /// Samples the plant, which is at `step`, if a sample is due.
  void sample(const Plant& plant, std::int64_t step) {
    if (step != next_step_) return;
    put(plant, step);
    next_step_ = clock_.find_next_sample(step);
  }

  /// The step whose state it shows at `step`.
  std::int64_t find_seen(std::int64_t step) const { return clock_.find_seen(step); }

  /// The output for a vehicle at `step`, where the plant is.
  Sample show(const Plant& plant, std::size_t vehicle, std::int64_t step) {
    return next_step_ == SampleClock::kNever ? Sample(plant.measurement(vehicle))
                                             : lines_[vehicle].take(clock_.find_seen(step));
  }

  /// Number of samples kept per vehicle.
  std::size_t kept() const { return lines_.front().size(); }

 private:
  void put(const Plant& plant, std::int64_t step) {
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      lines_[i].put(step, Sample(plant.measurement(i)));
      lines_[i].take(clock_.find_seen(step));  // removes samples that are not shown any more
    }
  }

  SampleClock clock_;
  std::vector<DelayLine<Sample>> lines_;  // by vehicle
  std::int64_t next_step_;
};

}  // namespace sls::sim
