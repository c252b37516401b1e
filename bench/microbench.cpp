// Measures each function of a step alone, with Google Benchmark.
#include <benchmark/benchmark.h>
#include <slsPubSubTypes.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "closed_loop/flight.hpp"
#include "common/bus/convert.hpp"
#include "common/bus/fastdds/guarded_type.hpp"
#include "common/config/scenario.hpp"
#include "control_client/flight_controller.hpp"
#include "fastdds_types.hpp"
#include "sim_server/plants/analytic/analytic_plant.hpp"
#include "sim_server/plants/cables/hybrid_motion.hpp"
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

/// A step of 1 ms of vehicles that carry one load on a ring of cables, with new forces; the load is
/// a point or turns.
void step_cables(benchmark::State& run, bool is_rigid) {
  using namespace sim::cables;
  System system;
  system.count = static_cast<std::size_t>(run.range(0));
  system.is_rigid = is_rigid;
  system.inertia_L = system.inverse_inertia_L = Eigen::Matrix3d::Identity();
  Motion start{};
  start.p_WL = start.v_WL = start.w_WL_L = Eigen::Vector3d::Zero();
  start.q_WL = {1.0, 0.0, 0.0, 0.0};
  Actions actions;
  const double share = system.load_mass * system.gravity / static_cast<double>(system.count);
  for (std::size_t i = 0; i < system.count; ++i) {
    const double at = 6.2831853 * static_cast<double>(i) / static_cast<double>(system.count);
    const Eigen::Vector3d out(std::cos(at), std::sin(at), 0.0);
    system.vehicle_mass[i] = 0.5;
    system.attachment_L[i] = is_rigid ? Eigen::Vector3d(0.3 * out) : Eigen::Vector3d::Zero();
    const double lean = system.count > 1 ? 0.4 : 0.0;
    const Eigen::Vector3d up = std::sin(lean) * out - std::cos(lean) * Eigen::Vector3d::UnitZ();
    start.vehicles[i] = {system.attachment_L[i] + up, Eigen::Vector3d::Zero(), 1.0, 0.0};
    actions.f_Q_W[i] =
        share / std::cos(lean) * up - 0.5 * system.gravity * Eigen::Vector3d::UnitZ();
  }
  std::optional<HybridMotion> motion;
  std::vector<Event> events;
  for (std::size_t step = 0; run.KeepRunning(); ++step) {
    if (step % 256 == 0) motion.emplace(system, start);  // before the shaking slackens a cable
    actions.f_Q_W[0].x() += step % 2 == 0 ? 0.1 : -0.1;
    motion->step(actions, 0.001, events);
  }
  if (!events.empty()) run.SkipWithError("expected taut cables");
}
void cables_point_step(benchmark::State& run) { step_cables(run, false); }
void cables_rigid_step(benchmark::State& run) { step_cables(run, true); }
BENCHMARK(cables_point_step)->Arg(1)->Arg(3)->Arg(6)->Arg(16);
BENCHMARK(cables_rigid_step)->Arg(1)->Arg(3)->Arg(6)->Arg(16);

const std::vector<model::StepRecord>& records() {
  static const std::vector<model::StepRecord> flown = [] {
    std::vector<model::StepRecord> steps;
    for (closed_loop::Flight flight(load()); steps.size() < 1000;)
      steps.push_back(*flight.fly_step());
    return steps;
  }();
  return flown;
}

void control_law(benchmark::State& run) {
  const control::FlightController controller(load());
  std::size_t i = records().size();  // flies them before the measurement starts
  for (auto _ : run) {
    const model::StepRecord& record = records()[i++ % records().size()];
    benchmark::DoNotOptimize(controller.calc_answer(record.step, record.truth, {}));
  }
}
BENCHMARK(control_law);

/// Time to serialise and deserialise a sample; `make` makes it from a record.
template <class Type, class Make>
void serialize(benchmark::State& run, const Make& make) {
  using Message = typename Type::type;
  Type type;
  std::vector<Message> samples;
  for (const model::StepRecord& record : records()) samples.push_back(make(record));
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
  serialize<bus::GuardedType<StatesPubSubType>>(run, [](const model::StepRecord& record) {
    States sample;
    bus::fill(sample.vehicles().emplace_back(), record);
    return sample;
  });
}
void serialize_command(benchmark::State& run) {
  serialize<bus::GuardedType<CommandsPubSubType>>(run, [](const model::StepRecord& record) {
    Commands sample;
    bus::fill(sample.vehicles().emplace_back(), record.vehicle_id, record.answer);
    return sample;
  });
}
void serialize_batch_of_16_entries(benchmark::State& run) {
  serialize<bus::GuardedType<RecordBatchPubSubType>>(run, [](const model::StepRecord& record) {
    RecordBatch sample;
    bus::fill(sample.entries().emplace_back(), record);
    sample.entries().resize(16, RecordEntry(sample.entries().front()));
    return sample;
  });
}
BENCHMARK(serialize_state);
BENCHMARK(serialize_command);
BENCHMARK(serialize_batch_of_16_entries);

}  // namespace
}  // namespace sls::bench

BENCHMARK_MAIN();
