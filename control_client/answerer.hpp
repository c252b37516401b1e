/// The answers of a client to the states of its run. No network, thread or clock here: the shell
/// (control_client/client.hpp) receives, writes and has the lock.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/peer.hpp"
#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "common/sync/servers.hpp"
#include "control_client/flight_controller.hpp"
#include "control_client/laws/control_law.hpp"

namespace sls::control {

/// The vehicles of a run with their controllers. An answer depends on the state alone, and a
/// state that comes again gets the same answer without a second computation.
class Answerer {
 public:
  struct Options {
    std::string name;
    std::int32_t strength = 0;
    bool checks_purity = false;  ///< as of FlightController
    LawMaker make_law = &make_control_law;
    std::function<sync::Time()> read_clock;  ///< for the compute times
    /// Gets a line for each answer with an error code.
    std::function<void(const std::string&)> report_error;
    std::string other_flight;  ///< ends the message about a server with another scenario
  };

  /// Flies the vehicles of `vehicle_ids` in `run`, whose scenario is that of the client.
  /// @throws config::ConfigError if the scenario is another one, or the law cannot be made.
  Answerer(const config::Scenario& scenario, const sync::Run& run,
           const std::vector<std::uint32_t>& vehicle_ids, const Options& options);

  const sync::Run& run() const { return run_; }
  /// The scenario with the period of the run.
  const config::Scenario& scenario() const { return scenario_; }

  /// The answers to `sample`, which is of this run and from its server; null if it has none of our
  /// vehicles.
  /// @throws std::runtime_error if a law of a shared library is broken.
  const Commands* answer(const States& sample);

 private:
  struct Pilot {
    FlightController controller;
    std::optional<std::uint64_t> last_step;
    ControlCommand last_command;  // the answer to that step: a repeated sample gets it again
  };

  const ControlCommand& answer(Pilot& pilot, std::uint64_t step, const VehicleState& state);

  const sync::Run run_;
  const config::Scenario scenario_;
  const Options options_;
  std::map<std::uint32_t, Pilot> pilots_;
  Commands answers_;  // to the current sample
};

}  // namespace sls::control
