/// The samples that server and client would publish of a flight in one process.
#pragma once

#include <cstdint>
#include <vector>

#include "closed_loop/flight.hpp"
#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/messages.hpp"

namespace sls::closed_loop {

/// What the three topics carry of one step of one vehicle.
struct StepSamples {
  VehicleState state;
  ControlCommand command;
  Reference reference;
};

/// Of one vehicle: call once per step, in order, from step 0.
class SampleMaker {
 public:
  SampleMaker(std::uint64_t run_id, std::uint32_t vehicle_id, std::int64_t period_ns)
      : run_id_(run_id), vehicle_id_(vehicle_id), period_ns_(period_ns) {}

  StepSamples make(const FlownStep& flown, const std::string& controller_name);

 private:
  std::uint64_t run_id_;
  std::uint32_t vehicle_id_;
  std::int64_t period_ns_;
  sim::Applied applied_;  // in the period before
};

/// Samples of the first `steps` steps of vehicle 0 of `scenario`.
std::vector<StepSamples> fly_samples(const config::Scenario& scenario, std::size_t steps,
                                     std::uint64_t run_id);

/// What a server of `vehicles` vehicles claims.
Parameters make_parameters(const config::Scenario& scenario, std::uint64_t run_id,
                           std::uint32_t vehicles);

SimStatus make_status(std::uint64_t run_id, std::uint64_t index, RunPhase phase,
                      std::uint64_t step);

}  // namespace sls::closed_loop
