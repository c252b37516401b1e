// What one step is made of, each function by itself: Google Benchmark.
#include <benchmark/benchmark.h>
#include <slsPubSubTypes.h>

#include <memory>
#include <vector>

#include "closed_loop/samples.hpp"
#include "common/config/scenario.hpp"
#include "control_client/flight_controller.hpp"
#include "control_client/messages.hpp"
#include "sim_server/messages.hpp"
#include "sim_server/plants/analytic/analytic_plant.hpp"
#include "sim_server/plants/slung_load/slung_load_plant.hpp"

namespace sls::bench {
namespace {

config::Scenario load() { return config::load_scenario(SLS_SCENARIO); }

Eigen::Vector3d make_hover_force(const config::Scenario& scenario) {
  const auto& vehicle = scenario.vehicle;
  return {0.0, 0.0, -(vehicle.quad_mass + vehicle.load_mass) * vehicle.gravity};
}

/// Time of one RK4 step of one vehicle, of a fleet of independent plants.
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

const std::vector<closed_loop::StepSamples>& samples() {
  static const std::vector<closed_loop::StepSamples> flown =
      closed_loop::fly_samples(load(), 1000, 1);
  return flown;
}

void control_law(benchmark::State& run) {
  const control::FlightController controller(load());
  std::size_t i = 0;
  for (auto _ : run) {
    const VehicleState& state = samples()[i++ % samples().size()].state;
    benchmark::DoNotOptimize(
        controller.calc_answer(state.step(), control::to_model_state(state),
                               control::to_memory(state.controller(), controller.memory_size())));
  }
}
BENCHMARK(control_law);

template <class Type, class Message>
void serialize(benchmark::State& run, Message closed_loop::StepSamples::*member) {
  Type type;
  const auto& all = samples();
  eprosima::fastrtps::rtps::SerializedPayload_t payload(type.m_typeSize);
  Message back;
  std::size_t i = 0;
  for (auto _ : run) {
    type.serialize(const_cast<Message*>(&(all[i++ % all.size()].*member)), &payload);
    type.deserialize(&payload, &back);
    benchmark::DoNotOptimize(back);
  }
}
void serialize_state(benchmark::State& run) {
  serialize<VehicleStatePubSubType>(run, &closed_loop::StepSamples::state);
}
void serialize_command(benchmark::State& run) {
  serialize<ControlCommandPubSubType>(run, &closed_loop::StepSamples::command);
}
void serialize_reference(benchmark::State& run) {
  serialize<ReferencePubSubType>(run, &closed_loop::StepSamples::reference);
}
BENCHMARK(serialize_state);
BENCHMARK(serialize_command);
BENCHMARK(serialize_reference);

}  // namespace
}  // namespace sls::bench

BENCHMARK_MAIN();
