#include "closed_loop/flight.hpp"

#include <chrono>
#include <exception>
#include <utility>

namespace sls::closed_loop {
namespace {

using Clock = std::chrono::steady_clock;

}  // namespace

Flight::Flight(const config::Scenario& scenario, const std::vector<std::uint32_t>& ids,
               const FlightOptions& options)
    : controller_name_(options.controller_name),
      measures_compute_time_(options.measures_compute_time),
      steps_per_period_(scenario.sync.period_ns / scenario.plant.step_ns),
      limits_(sim::make_answer_limits(scenario)),
      is_fleet_(scenario.vehicles.size() > 1),
      plants_(sim::make_plants(sim::find_plant_type(scenario.plant.model), scenario, ids)),
      steps_(ids.size()) {
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const config::Scenario alone = config::make_vehicle_scenario(scenario, ids[i]);
    vehicles_.push_back(
        {sim::FaultLine(alone, ids[i]),
         control::FlightController(alone, ids[i], options.checks_purity, options.make_law)});
    steps_[i].vehicle_id = ids[i];
    steps_[i].kind = model::AnswerKind::kAccepted;
    steps_[i].client_name = controller_name_;
  }
}

const model::StepRecord* Flight::fly_step() {
  if (has_ended_) return nullptr;
  if (has_begun_ && !advance()) {
    has_ended_ = true;
    return nullptr;
  }
  has_begun_ = true;
  for (sim::PlantOfVehicles& group : plants_)
    for (std::size_t i = 0; i < group.vehicles.size(); ++i) {
      model::StepRecord& flown = steps_[group.vehicles[i]];
      Vehicle& vehicle = vehicles_[group.vehicles[i]];
      flown.truth = group.plant->measurement(i);
      if (vehicle.faults.can_disturb_state() || !group.plant->sees_truth())
        flown.measured = vehicle.faults.measure(flown.step, group.plant->seen(i));
      flown.answered_step = flown.step;
      const model::ControllerMemory memory = flown.answer.memory;
      const auto began = measures_compute_time_ ? Clock::now() : Clock::time_point();
      try {
        flown.answer = vehicle.controller.calc_answer(flown.step, flown.seen(), memory);
      } catch (const std::exception& error) {
        failure_ = error.what();
        is_law_broken_ = has_ended_ = true;
        return nullptr;
      }
      if (measures_compute_time_) flown.answer.compute_time = Clock::now() - began;
    }
  has_ended_ = is_last();
  return &steps_.front();
}

bool Flight::advance() {
  for (sim::PlantOfVehicles& group : plants_) {
    group.forces.clear();
    for (const std::size_t i : group.vehicles) {
      model::StepRecord& flown = steps_[i];
      flown.f_Q_W = vehicles_[i].faults.actuate(flown.step, flown.answer.f_Q_W);
      ++flown.step;
      group.forces.push_back(flown.f_Q_W);
    }
    try {
      group.plant->advance(group.forces, steps_per_period_);
    } catch (const std::exception& error) {
      failure_ = name_vehicle(group.vehicles.front()) + error.what();
      return false;
    }
  }
  return true;
}

bool Flight::is_last() {
  bool is_finished = true;
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const std::uint64_t step = steps_[i].step;
    const model::Answer& answer = steps_[i].answer;
    if (const auto defect = sim::find_defect(step, answer, limits_)) {
      steps_[i].kind = model::AnswerKind::kRefused;
      failure_ =
          name_vehicle(i) + sim::describe_refusal(*defect, step, answer, limits_, controller_name_);
      return true;
    }
    is_finished = is_finished && answer.mission == model::MissionPhase::kFinished;
  }
  return is_finished;
}

std::string Flight::name_vehicle(std::size_t index) const {
  return is_fleet_ ? "vehicle " + std::to_string(steps_[index].vehicle_id) + ": " : std::string();
}

std::vector<std::string> Flight::take_remarks() {
  std::vector<std::string> remarks;
  for (const sim::PlantOfVehicles& group : plants_)
    for (std::size_t i = 0; i < group.vehicles.size(); ++i)
      for (const std::string& remark : group.plant->take_remarks(i))
        remarks.push_back("vehicle " + std::to_string(steps_[group.vehicles[i]].vehicle_id) + ": " +
                          remark);
  return remarks;
}

std::vector<model::StepRecord> fly(const config::Scenario& scenario, std::uint32_t vehicle) {
  Flight flight(scenario, vehicle);
  std::vector<model::StepRecord> steps;
  while (const model::StepRecord* step = flight.fly_step()) steps.push_back(*step);
  return steps;
}

}  // namespace sls::closed_loop
