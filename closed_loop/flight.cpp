#include "closed_loop/flight.hpp"

#include <chrono>
#include <exception>
#include <numeric>
#include <utility>

namespace sls::closed_loop {
namespace {

using Clock = std::chrono::steady_clock;

}  // namespace

std::vector<std::uint32_t> list_vehicles(const config::Scenario& scenario) {
  std::vector<std::uint32_t> ids(scenario.vehicles.size());
  std::iota(ids.begin(), ids.end(), 0);
  return ids;
}

Flight::Flight(const config::Scenario& scenario, const std::vector<std::uint32_t>& ids,
               const FlightOptions& options)
    : controller_name_(options.controller_name),
      measures_compute_time_(options.measures_compute_time),
      limits_(sim::make_answer_limits(scenario)),
      is_fleet_(scenario.vehicles.size() > 1),
      plants_(scenario, ids, sim::one_after_another) {
  for (model::StepRecord& record : plants_.records()) {
    controllers_.emplace_back(config::make_vehicle_scenario(scenario, record.vehicle_id),
                              record.vehicle_id, options.checks_purity, options.make_law);
    record.kind = model::AnswerKind::kAccepted;
    record.client_name = controller_name_;
  }
}

const model::StepRecord* Flight::fly_step() {
  if (has_ended_) return nullptr;
  bool has_moved = false;
  try {
    std::exchange(has_begun_, true) ? plants_.advance() : plants_.begin();
    has_moved = true;
    answer();
  } catch (const std::exception& error) {
    failure_ = error.what();
    has_ended_ = true;
    is_law_broken_ = has_moved;
    return nullptr;
  }
  has_ended_ = is_last();
  return &steps().front();
}

void Flight::answer() {
  for (std::size_t i = 0; i < controllers_.size(); ++i) {
    model::StepRecord& record = plants_.records()[i];
    record.answered_step = record.step;
    const model::ControllerMemory memory = record.answer.memory;
    const auto began = measures_compute_time_ ? Clock::now() : Clock::time_point();
    record.answer = controllers_[i].calc_answer(record.step, record.seen(), memory);
    if (measures_compute_time_) record.answer.compute_time = Clock::now() - began;
  }
}

bool Flight::is_last() {
  bool is_finished = true;
  for (model::StepRecord& record : plants_.records()) {
    if (const auto defect = sim::find_defect(record.step, record.answer, limits_)) {
      record.kind = model::AnswerKind::kRefused;
      failure_ =
          (is_fleet_ ? "vehicle " + std::to_string(record.vehicle_id) + ": " : std::string()) +
          sim::describe_refusal(*defect, record.step, record.answer, limits_, controller_name_);
      return true;
    }
    is_finished = is_finished && record.answer.mission == model::MissionPhase::kFinished;
  }
  return is_finished;
}

std::vector<model::StepRecord> fly(const config::Scenario& scenario, std::uint32_t vehicle) {
  Flight flight(scenario, vehicle);
  std::vector<model::StepRecord> steps;
  while (const model::StepRecord* step = flight.fly_step()) steps.push_back(*step);
  return steps;
}

}  // namespace sls::closed_loop
