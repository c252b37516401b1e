#include "sim_server/messages.hpp"

#include <random>

#include "common/bus/convert.hpp"
#include "common/plugin/shared_library.hpp"

namespace sls::sim {

std::uint64_t make_run_id() {
  std::random_device random;
  std::uint64_t id = 0;
  while (id == 0) id = (static_cast<std::uint64_t>(random()) << 32) | random();
  return id;
}

Parameters make_parameters_message(std::uint64_t run_id,
                                   const std::vector<std::uint32_t>& vehicle_ids,
                                   const config::Scenario& scenario, const Plant& plant,
                                   const std::string& version) {
  Parameters message;
  message.run_id(run_id);
  message.contract_sha256(bus::kContractSha256);
  message.version(version);
  message.scenario_sha256(scenario.sha256);
  message.scenario_text(scenario.text);
  message.library_sha256(plugin::find_loaded_sha256(config::find_plant_library(scenario)));
  for (const std::uint32_t id : vehicle_ids) {
    VehicleParameters& item = message.vehicles().emplace_back();
    item.vehicle_id(id);
    bus::fill(item, config::make_vehicle_scenario(scenario, id).vehicle);
  }
  message.has_attitude(plant.has_attitude());
  for (const Signal& signal : plant.signals()) {
    SignalDescription& item = message.signals().emplace_back();
    item.name(signal.name);
    item.unit(signal.unit);
  }
  message.force_limit_n(scenario.controller.force_limit_n);
  message.expected_recorders(static_cast<std::uint32_t>(scenario.sync.wait_for.recorders));
  message.period_ns(scenario.sync.period_ns);
  message.step_ns(scenario.plant.step_ns);
  const bool lockstep = scenario.sync.mode == config::SyncMode::kLockstep;
  message.mode(lockstep ? SyncMode::MODE_LOCKSTEP : SyncMode::MODE_REALTIME);
  message.real_time_factor(lockstep ? 0.0 : scenario.sync.real_time_factor);
  return message;
}

void fill(CommandSample& received, const Commands& sample) {
  received.run_id = sample.run_id();
  received.step = sample.step();
  received.client_name = sample.client_name().c_str();
  received.answers.resize(sample.vehicles().size());
  for (std::size_t i = 0; i < received.answers.size(); ++i) {
    OfferedAnswer& offered = received.answers[i];
    offered.run_id = received.run_id;
    offered.step = received.step;
    offered.client_name = received.client_name;
    offered.vehicle_id = sample.vehicles()[i].vehicle_id();
    bus::fill(offered.answer, sample.vehicles()[i]);
  }
}

}  // namespace sls::sim
