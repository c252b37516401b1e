// Measures each function of a step alone, with Google Benchmark.
#include <benchmark/benchmark.h>
#include <slsPubSubTypes.h>

#include <memory>
#include <string>
#include <vector>

#include "closed_loop/record_entries.hpp"
#include "common/bus/convert.hpp"
#include "common/bus/fastdds/guarded_type.hpp"
#include "common/config/scenario.hpp"
#include "control_client/flight_controller.hpp"
#include "fastdds_types.hpp"
#include "sim_server/plants/analytic/analytic_plant.hpp"
#include "sim_server/plants/plant.hpp"
#include "sim_server/plants/slung_load/slung_load_plant.hpp"

namespace sls::bench {
namespace {

config::Scenario load(const std::string& name = "figure_eight") {
  return config::load_scenario(SLS_SCENARIOS "/" + name + ".yaml");
}

Eigen::Vector3d make_hover_force(const config::Scenario& scenario) {
  const auto& vehicle = scenario.vehicle;
  return {0.0, 0.0, -(vehicle.quad_mass + vehicle.load_mass) * vehicle.gravity};
}

/// Time of one RK4 step per vehicle, for a fleet of independent plants.
template <class Plant>
void step_plants(benchmark::State& run) {
  const config::Scenario scenario = load();
  const std::vector<Eigen::Vector3d> f_Q_W = {make_hover_force(scenario)};
  std::vector<std::unique_ptr<Plant>> plants;
  for (std::int64_t i = 0; i < run.range(0); ++i)
    plants.push_back(std::make_unique<Plant>(scenario.vehicle, scenario.plant));
  while (run.KeepRunningBatch(run.range(0)))
    for (const auto& plant : plants) plant->advance(f_Q_W, 1);
}
void plant_step(benchmark::State& run) { step_plants<sim::SlungLoadPlant>(run); }
BENCHMARK(plant_step)->Arg(1)->Arg(2)->Arg(10)->Arg(100);

/// The same equations in closed form.
void closed_form_step(benchmark::State& run) { step_plants<sim::AnalyticPlant>(run); }
BENCHMARK(closed_form_step)->Arg(1)->Arg(2)->Arg(10)->Arg(100);

/// The same for the multirotors of a scenario, with autopilot and signals, without sensors.
void step_multirotors(benchmark::State& run, const std::string& name) {
  config::Scenario scenario = load(name);
  scenario.sensing = {};
  const std::vector<Eigen::Vector3d> f_Q_W = {make_hover_force(scenario)};
  const sim::PlantType& type = sim::find_plant_type(scenario.plant.model);
  std::vector<std::unique_ptr<sim::Plant>> plants;
  for (std::int64_t i = 0; i < run.range(0); ++i)
    plants.push_back(std::move(sim::make_plants(type, scenario, {0})[0].plant));
  while (run.KeepRunningBatch(run.range(0)))
    for (const auto& plant : plants) plant->advance(f_Q_W, 1);
}
void px4_published_step(benchmark::State& run) { step_multirotors(run, "px4_published"); }
void multirotor_figure_eight_step(benchmark::State& run) {
  step_multirotors(run, "multirotor_figure_eight");
}
BENCHMARK(px4_published_step)->Arg(1)->Arg(100);
BENCHMARK(multirotor_figure_eight_step)->Arg(1)->Arg(100);

const std::vector<RecordEntry>& entries() {
  static const std::vector<RecordEntry> flown = closed_loop::fly_entries(load(), 1000);
  return flown;
}

void control_law(benchmark::State& run) {
  const control::FlightController controller(load());
  std::size_t i = entries().size();  // flies them before the measurement starts
  for (auto _ : run) {
    const RecordEntry& entry = entries()[i++ % entries().size()];
    benchmark::DoNotOptimize(
        controller.calc_answer(entry.step(), bus::to_measurement(entry.truth()), {}));
  }
}
BENCHMARK(control_law);

/// Time to serialise and deserialise a sample; `make` makes it from an entry.
template <class Type, class Make>
void serialize(benchmark::State& run, const Make& make) {
  using Message = typename Type::type;
  Type type;
  std::vector<Message> samples;
  for (const RecordEntry& entry : entries()) samples.push_back(make(entry));
  bus::rtps::SerializedPayload_t payload(bus::max_size_of(type));
  Message back;
  std::size_t i = 0;
  for (auto _ : run) {
    bus::serialize(type, &samples[i++ % samples.size()], payload);
    bus::deserialize(type, payload, &back);
    benchmark::DoNotOptimize(back);
  }
}
void serialize_state(benchmark::State& run) {
  serialize<bus::GuardedType<StatesPubSubType>>(run, [](const RecordEntry& entry) {
    States sample;
    VehicleState& state = sample.vehicles().emplace_back();
    state.measured(entry.truth());
    state.controller_name(entry.client_name());
    return sample;
  });
}
void serialize_command(benchmark::State& run) {
  serialize<bus::GuardedType<CommandsPubSubType>>(run, [](const RecordEntry& entry) {
    Commands sample;
    sample.vehicles().push_back(entry.answer());
    return sample;
  });
}
void serialize_batch_of_16_entries(benchmark::State& run) {
  serialize<bus::GuardedType<RecordBatchPubSubType>>(run, [](const RecordEntry& entry) {
    RecordBatch sample;
    sample.entries().assign(16, entry);
    return sample;
  });
}
BENCHMARK(serialize_state);
BENCHMARK(serialize_command);
BENCHMARK(serialize_batch_of_16_entries);

}  // namespace
}  // namespace sls::bench

BENCHMARK_MAIN();
