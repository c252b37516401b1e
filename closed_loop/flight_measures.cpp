#include "closed_loop/flight_measures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <variant>

#include "common/model/invariants.hpp"

namespace sls::closed_loop {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
constexpr std::array kMeasures = {
    "load_error_rms", "load_error_max", "settling",       "overshoot",      "tilt_max",
    "force_max",      "time_of_loss",   "load_error_end", "quad_error_rms", "quad_error_max",
    "quad_error_end", "attitude_max",   "energy_max",     "outcome"};

std::string to_prefix(std::size_t stage) { return "stage_" + std::to_string(stage) + "_"; }

std::string list_measures() {
  std::string text;
  for (std::size_t i = 0; i < kMeasures.size(); ++i)
    text += (i == 0 ? "" : i + 1 == kMeasures.size() ? " or " : ", ") + std::string(kMeasures[i]);
  return text;
}

}  // namespace

// --- list ----------------------------------------------------------------------------------------

MeasureList::MeasureList(const config::Scenario& base, std::vector<std::string> names)
    : names_(std::move(names)) {
  for (const config::Stage& stage : base.mission)
    stages_.push_back(std::holds_alternative<config::ConstantReference>(stage.reference));
  const FlightMeasures nothing(*this, base.sync.period_ns, base.vehicle, false);
  for (const std::string& name : names_) {
    if (std::find(kMeasures.begin(), kMeasures.end(), name) == kMeasures.end())
      throw config::ConfigError("measure: expected " + list_measures() + ", got '" + name + "'");
    for (const auto& [column, value] : nothing.list_values(name, std::nullopt))
      columns_.push_back(column);
  }
}

bool MeasureList::has(const std::string& name) const {
  return std::any_of(names_.begin(), names_.end(),
                     [&](const std::string& own) { return own.rfind(name, 0) == 0; });
}

// --- flight --------------------------------------------------------------------------------------

void FlightMeasures::Step::add(const model::StepRecord& step, double time_s) {
  const Eigen::Vector3d& reference = step.answer.reference.position;
  if (!has_begun) {
    has_begun = true;
    target = reference;
  }
  is_constant = is_constant && reference == target;
  responses.add(time_s, step.truth.p_WL - target);
}

FlightMeasures::FlightMeasures(const MeasureList& list, std::int64_t period_ns,
                               const model::SlungLoadParameters& vehicle, bool has_attitude)
    : list_(list),
      period_ns_(period_ns),
      has_quad_errors_(list.has("quad_error")),
      has_energy_(list.has("energy_max")),
      vehicle_(vehicle),
      has_attitude_(has_attitude),
      stages_(list.stages().size()),
      steps_(list.stages().size()) {}

void FlightMeasures::add(const model::StepRecord& step) {
  const model::Measurement& truth = step.truth;
  const std::size_t stage = step.answer.stage;
  const bool is_known = stage < stages_.size();  // a run may have more stages than its base
  const auto add_errors = [&](model::ErrorStatistics Errors::*of, const Eigen::Vector3d& error) {
    (errors_.*of).add(error);
    if (is_known) (stages_[stage].*of).add(error);
  };
  add_errors(&Errors::load, truth.p_WL - step.answer.reference.position);
  if (has_quad_errors_)
    add_errors(&Errors::quad,
               truth.p_WQ - model::calc_quad_reference(step.answer.reference, vehicle_));
  if (is_known && list_.stages()[stage]) {
    const auto time_ns = static_cast<std::int64_t>(step.step) * period_ns_;
    steps_[stage].add(step, static_cast<double>(time_ns) / 1e9);
  }
  tilt_.add(model::calc_rod_tilt(truth.p_WL - truth.p_WQ), step.step);
  if (has_attitude_) attitude_.add(model::calc_body_tilt(truth.attitude.q_WB), step.step);
  squared_force_.add(step.answer.f_Q_W.squaredNorm(), step.step);
  if (has_energy_) energy_.add(model::calc_energy(truth, vehicle_), step.step);
}

std::vector<FlightMeasures::NamedValue> FlightMeasures::list_values(
    const std::string& measure, std::optional<double> time_of_loss_s) const {
  std::vector<NamedValue> values;
  const auto add_axes = [&](const std::string& prefix, const std::string& suffix,
                            const auto& calc) {
    for (int axis = 0; axis < 3; ++axis)
      values.emplace_back(prefix + "_" + kAxes[static_cast<std::size_t>(axis)] + suffix,
                          calc(axis));
  };
  const auto add_errors = [&](double (model::ErrorStatistics::*calc)(int) const) {
    const auto of = measure.rfind("quad_", 0) == 0 ? &Errors::quad : &Errors::load;
    values.emplace_back(measure + "_m", ((errors_.*of).*calc)(model::kNorm));
    add_axes(measure, "_m", [&](int axis) { return ((errors_.*of).*calc)(axis); });
    for (std::size_t i = 0; i < stages_.size(); ++i)
      add_axes(to_prefix(i) + measure, "_m",
               [&](int axis) { return ((stages_[i].*of).*calc)(axis); });
  };
  const auto add_steps = [&](const std::string& suffix,
                             double (model::StepResponse::*calc)() const) {
    for (std::size_t i = 0; i < steps_.size(); ++i)
      if (list_.stages()[i])
        add_axes(to_prefix(i) + measure, suffix, [&](int axis) {
          return steps_[i].is_constant ? (steps_[i].responses[axis].*calc)() : kNan;
        });
  };
  const auto ends_with = [&](const std::string& end) {
    return measure.size() > end.size() && measure.substr(measure.size() - end.size()) == end;
  };
  if (ends_with("_error_rms"))
    add_errors(&model::ErrorStatistics::calc_rms);
  else if (ends_with("_error_max"))
    add_errors(&model::ErrorStatistics::calc_max);
  else if (ends_with("_error_end"))
    add_errors(&model::ErrorStatistics::calc_end);
  else if (measure == "settling")
    add_steps("_s", &model::StepResponse::calc_settling_time);
  else if (measure == "overshoot")
    add_steps("", &model::StepResponse::calc_overshoot);
  else if (measure == "tilt_max")
    values.emplace_back("tilt_max_rad", tilt_.value());
  else if (measure == "attitude_max")
    values.emplace_back("attitude_max_rad", attitude_.value());
  else if (measure == "force_max")
    values.emplace_back("force_max_n", std::sqrt(squared_force_.value()));
  else if (measure == "energy_max")
    values.emplace_back("energy_max_j", energy_.value());
  else if (measure == "time_of_loss")
    values.emplace_back("time_of_loss_s", time_of_loss_s.value_or(kNan));
  return values;
}

std::vector<double> FlightMeasures::finish(std::optional<double> time_of_loss_s) const {
  std::vector<double> values;
  for (const std::string& name : list_.names())
    for (const auto& [column, value] : list_values(name, time_of_loss_s)) values.push_back(value);
  return values;
}

}  // namespace sls::closed_loop
