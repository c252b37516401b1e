/// A flight of a campaign: its outcome, its measures and, if requested, its certificate. Writes no
/// files.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "closed_loop/flight.hpp"
#include "closed_loop/flight_measures.hpp"
#include "closed_loop/loss.hpp"
#include "common/config/scenario.hpp"

namespace sls::closed_loop {

enum class Outcome {
  kFinished,
  kLost,    ///< a load is more than one rod length further from its reference than in the base
  kFailed,  ///< an error code, a refused force, or a plant that is not finite
};

/// "finished", "lost", "failed".
const char* to_string(Outcome outcome);

struct MeasuredFlight {
  Outcome outcome = Outcome::kFinished;
  std::string reason;          ///< with the time; one line, empty if finished
  std::vector<double> values;  ///< of the columns of the measures, the largest of all vehicles;
                               ///< NaN: not defined for any
  std::string certificate;     ///< empty if it was not requested
  std::uint64_t steps = 0;     ///< number of answered steps of each vehicle, also after a loss
};

/// Called repeatedly during a flight; may throw to end it.
using Poll = std::function<void()>;

/// Flies all vehicles of `scenario`. Measures are over the steps up to and including the loss,
/// where the flight ends. With `certify` it continues to its normal end, so its certificate is that
/// of a recording.
/// @throws config::ConfigError as Flight does, and for another number of vehicles than in `base`.
MeasuredFlight fly_measured(const config::Scenario& scenario, const MeasureList& measures,
                            const FlightErrors& base, bool certify,
                            const FlightOptions& options = {}, const Poll& poll = {});

/// Checks the scenario without a flight.
/// @throws config::ConfigError if fly_measured would.
void check_flight(const config::Scenario& scenario, const FlightErrors& base);

/// Flies the base scenario of a campaign, with which the others are compared for loss of the load.
/// @throws config::ConfigError if it fails, and as Flight does.
FlightErrors fly_base(const config::Scenario& base, const Poll& poll = {});

}  // namespace sls::closed_loop
