#include "closed_loop/record_entries.hpp"

#include "common/app/options.hpp"
#include "common/bus/convert.hpp"
#include "sim_server/messages.hpp"

namespace sls::closed_loop {
namespace {

constexpr const char* kController = "control_client";

}  // namespace

void fill_entry(RecordEntry& entry, std::uint32_t vehicle_id, const FlownStep& flown,
                const std::string& controller_name, bool is_refused) {
  entry.vehicle_id(vehicle_id);
  entry.step(flown.step);
  bus::fill(entry.truth(), flown.truth);
  entry.measured().resize(flown.can_measurement_differ ? 1 : 0);
  if (flown.can_measurement_differ) bus::fill(entry.measured().front(), flown.measured);
  entry.f_Q_W_n(bus::to_array(flown.applied_f_Q_W));
  entry.kind(is_refused ? AnswerKind::ANSWER_REFUSED : AnswerKind::ANSWER_ACCEPTED);
  entry.answered_step(flown.step);
  entry.client_name(controller_name);
  bus::fill(entry.answer(), vehicle_id, flown.answer);
}

RecordEntry make_entry(std::uint32_t vehicle_id, const FlownStep& flown,
                       const std::string& controller_name, bool is_refused) {
  RecordEntry entry;
  fill_entry(entry, vehicle_id, flown, controller_name, is_refused);
  return entry;
}

std::vector<RecordEntry> fly_entries(const config::Scenario& scenario, std::size_t steps) {
  std::vector<RecordEntry> entries;
  Flight flight(scenario);
  while (entries.size() < steps) {
    const FlownStep* flown = flight.fly_step();
    if (!flown) break;
    entries.push_back(make_entry(0, *flown, kController));
  }
  return entries;
}

Parameters make_parameters(const config::Scenario& scenario, std::uint64_t run_id,
                           std::uint32_t vehicles) {
  Parameters parameters =
      sim::make_parameters_message(run_id, {0}, scenario, Flight(scenario).plant(), app::version());
  parameters.vehicles().resize(vehicles, parameters.vehicles().front());
  for (std::uint32_t id = 0; id < vehicles; ++id) parameters.vehicles()[id].vehicle_id(id);
  return parameters;
}

SimStatus make_status(std::uint64_t run_id, std::uint64_t index, RunPhase phase,
                      std::uint64_t step) {
  SimStatus status;
  status.run_id(run_id);
  status.sample_index(index);
  status.phase(phase);
  status.step(step);
  status.controller_name(kController);
  status.timing("exact");
  return status;
}

}  // namespace sls::closed_loop
