/// A flight of a campaign: its outcome, its measures and, where that is asked for, its certificate.
/// No files.
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
  kLost,    ///< the load is more than one rod length further from its reference than in the base
  kFailed,  ///< a controller fault, a force that is refused, a plant that is not finite
};

/// "finished", "lost", "failed".
const char* to_string(Outcome outcome);

struct MeasuredFlight {
  Outcome outcome = Outcome::kFinished;
  std::string reason;          ///< and when; one line, empty if finished
  std::vector<double> values;  ///< of the columns of the measures; NaN: not defined
  std::string certificate;     ///< empty if it was not asked for
  std::uint64_t steps = 0;     ///< answered, all that were flown
};

/// Called repeatedly during a flight; may throw to end it.
using Poll = std::function<void()>;

/// Flies `scenario`, of one vehicle. Measures are over the steps up to the loss, that step
/// included. There the flight ends; but with `certify` it goes on to the end that it has in a
/// recording, whose certificate this is.
/// @throws config::ConfigError as Flight does, and for a fleet.
MeasuredFlight fly_measured(const config::Scenario& scenario, const MeasureList& measures,
                            const ErrorHistory& base, bool certify,
                            const FlightOptions& options = {}, const Poll& poll = {});

/// @throws config::ConfigError as fly_measured does; flies nothing.
void check_flight(const config::Scenario& scenario);

/// Flies the base scenario of a campaign, by which the load of the others is lost or not.
/// @throws config::ConfigError if it fails, and as fly_measured does.
ErrorHistory fly_base(const config::Scenario& base, const Poll& poll = {});

}  // namespace sls::closed_loop
