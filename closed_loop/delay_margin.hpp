/// Delay margin: the longest delay of the forces at which the controllers do not lose the load.
/// Definition and search: README.md.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"

namespace sls::closed_loop {

/// A flight whose command is delayed by this many control periods.
struct DelayedFlight {
  std::int64_t periods = 0;
  double worst_error = 0.0;  ///< largest distance of a load from its reference, m
  double rms_error = 0.0;    ///< over all steps flown by all vehicles, m
  std::string loss;          ///< reason and time of the loss; empty if the load was not lost
  bool is_lost() const { return !loss.empty(); }
};

struct DelayMargin {
  std::int64_t period_ns = 0;
  /// Delay that the scenario has without the added one; 0 if the delayed vehicles differ in it.
  std::int64_t own_ns = 0;
  std::vector<DelayedFlight> flights;  ///< all that were flown, in order of delay

  /// The flight with the longest delay below the shortest lost one, and the shortest lost one. If
  /// no flight was lost, the latter is null.
  const DelayedFlight* longest_held() const;
  const DelayedFlight* shortest_lost() const;
};

/// Finds the margin to one control period by doubling and bisection, up to 10 s or 100,000 periods.
/// All vehicles fly. The commands of `vehicle` are delayed; none: those of all alike. The delay is
/// added to the scenario's own faults. `after_flight` is called after each flight and may throw to
/// end the search.
/// @throws config::ConfigError if there is no such vehicle, std::runtime_error if the scenario
/// loses a load without any added delay.
DelayMargin find_delay_margin(const config::Scenario& scenario,
                              std::optional<std::uint32_t> vehicle = {},
                              const std::function<void(const DelayedFlight&)>& after_flight = {});

/// A table, one row for each flight, and a line with the margin.
std::string to_text(const DelayMargin& margin);

}  // namespace sls::closed_loop
