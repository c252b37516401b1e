#include "closed_loop/recorded_flight.hpp"

#include "closed_loop/flight_recorder.hpp"
#include "common/app/options.hpp"
#include "common/app/stop_signal.hpp"
#include "common/plugin/shared_library.hpp"
#include "sim_server/messages.hpp"

namespace sls::closed_loop {

FlightEnd fly_recorded(const config::Scenario& scenario, const FlightOptions& options,
                       const std::filesystem::path& folder, bool force) {
  const std::vector<std::uint32_t> ids = list_vehicles(scenario);
  Flight flight(scenario, ids, options);
  FlightRecorder recorder(folder, force,
                          sim::make_parameters_message(sim::make_run_id(), ids, scenario,
                                                       flight.plant(), app::version()),
                          scenario.sync, options.controller_name);
  recorder.note_law_library(scenario);
  const plugin::LastWords words(
      [&recorder](const std::string& reason) { recorder.interrupt(reason); });
  while (app::stop_signal() == 0 && flight.fly_step()) {
    recorder.add(flight.steps());
    recorder.announce(flight.take_remarks());
  }
  recorder.announce(flight.take_remarks());  // of a step that failed
  if (app::stop_signal() != 0) {
    recorder.interrupt("interrupted");
    return {recorder.last_step(), "interrupted", false};
  }
  return {recorder.last_step(), flight.failure(), recorder.finish(flight.failure())};
}

}  // namespace sls::closed_loop
