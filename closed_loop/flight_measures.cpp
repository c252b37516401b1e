#include "closed_loop/flight_measures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <variant>

#include "common/model/math.hpp"

namespace sls::closed_loop {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSettlingBand = 0.02;
/// A stage that begins closer than this to its target has no step response, m.
constexpr double kLeastStep = 0.01;
constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
constexpr std::array<const char*, 8> kMeasures = {"load_error_rms", "load_error_max", "settling",
                                                  "overshoot",      "tilt_max",       "force_max",
                                                  "time_of_loss",   "outcome"};

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
  const FlightMeasures nothing(*this, base.sync.period_ns);
  for (const std::string& name : names_) {
    if (std::find(kMeasures.begin(), kMeasures.end(), name) == kMeasures.end())
      throw config::ConfigError("measure: expected " + list_measures() + ", got '" + name + "'");
    for (const auto& [column, value] : nothing.list_values(name, std::nullopt))
      columns_.push_back(column);
  }
}

// --- errors --------------------------------------------------------------------------------------

void FlightMeasures::Errors::add(const Eigen::Array3d& error) {
  const Eigen::Array3d squares = error.square();
  samples += 1.0;
  sum_of_squares += squares;
  max_square = max_square.max(squares);
  max_square_of_norm = std::max(max_square_of_norm, squares.sum());
}

Eigen::Array3d FlightMeasures::Errors::calc_rms() const {
  return (sum_of_squares / samples).sqrt();  // NaN without samples
}

Eigen::Array3d FlightMeasures::Errors::calc_max() const {
  if (samples == 0.0) return Eigen::Array3d::Constant(kNan);
  return max_square.sqrt();
}

double FlightMeasures::Errors::calc_norm_rms() const {
  return std::sqrt(sum_of_squares.sum() / samples);
}

double FlightMeasures::Errors::calc_norm_max() const {
  return samples == 0.0 ? kNan : std::sqrt(max_square_of_norm);
}

// --- steps ---------------------------------------------------------------------------------------

void FlightMeasures::Step::add(const model::StepRecord& step, double time_s) {
  const Eigen::Array3d reference = step.answer.reference.position.array();
  const Eigen::Array3d p_WL = step.truth.p_WL.array();
  if (!has_begun) {
    has_begun = true;
    start_s = time_s;
    target = reference;
    size = target - p_WL;
    settled_since_s.setConstant(kNan);
  }
  is_constant = is_constant && (reference == target).all();
  for (int axis = 0; axis < 3; ++axis) {
    const double deviation = p_WL[axis] - target[axis];
    if (std::abs(deviation) > kSettlingBand * std::abs(size[axis]))
      settled_since_s[axis] = kNan;
    else if (std::isnan(settled_since_s[axis]))
      settled_since_s[axis] = time_s;
    overshoot[axis] = std::max(overshoot[axis], deviation / size[axis]);
  }
}

bool FlightMeasures::Step::is_step(int axis) const {
  return has_begun && is_constant && std::abs(size[axis]) >= kLeastStep;
}

double FlightMeasures::Step::calc_settling_time(int axis) const {
  if (!is_step(axis)) return kNan;
  const double since_s = settled_since_s[axis];
  return std::isnan(since_s) ? kInfinity : since_s - start_s;
}

double FlightMeasures::Step::calc_overshoot(int axis) const {
  return is_step(axis) ? overshoot[axis] : kNan;
}

// --- all -----------------------------------------------------------------------------------------

FlightMeasures::FlightMeasures(const MeasureList& list, std::int64_t period_ns)
    : list_(list),
      period_ns_(period_ns),
      stages_(list.stages().size()),
      steps_(list.stages().size()) {}

void FlightMeasures::add(const model::StepRecord& step) {
  const Eigen::Array3d error = step.truth.p_WL - step.answer.reference.position;
  const std::size_t stage = step.answer.stage;
  errors_.add(error);
  if (stage < stages_.size()) {  // a run may have more stages than its base
    stages_[stage].add(error);
    if (list_.stages()[stage]) {
      const auto time_ns = static_cast<std::int64_t>(step.step) * period_ns_;
      steps_[stage].add(step, static_cast<double>(time_ns) / 1e9);
    }
  }
  const Eigen::Vector3d p_QL_W = step.truth.p_WL - step.truth.p_WQ;
  tilt_max_ = std::max(tilt_max_, math::atan2(p_QL_W.head<2>().norm(), p_QL_W.z()));
  max_square_of_force_ = std::max(max_square_of_force_, step.answer.f_Q_W.squaredNorm());
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
  const auto add_errors = [&](const auto& calc_norm, const auto& calc) {
    values.emplace_back(measure + "_m", calc_norm(errors_));
    add_axes(measure, "_m", [&, of_axes = calc(errors_)](int axis) { return of_axes[axis]; });
    for (std::size_t i = 0; i < stages_.size(); ++i)
      add_axes(to_prefix(i) + measure, "_m",
               [&, of_axes = calc(stages_[i])](int axis) { return of_axes[axis]; });
  };
  const auto add_steps = [&](const std::string& suffix, const auto& calc) {
    for (std::size_t i = 0; i < steps_.size(); ++i)
      if (list_.stages()[i])
        add_axes(to_prefix(i) + measure, suffix, [&](int axis) { return calc(steps_[i], axis); });
  };
  if (measure == "load_error_rms")
    add_errors([](const Errors& errors) { return errors.calc_norm_rms(); },
               [](const Errors& errors) { return errors.calc_rms(); });
  else if (measure == "load_error_max")
    add_errors([](const Errors& errors) { return errors.calc_norm_max(); },
               [](const Errors& errors) { return errors.calc_max(); });
  else if (measure == "settling")
    add_steps("_s", [](const Step& step, int axis) { return step.calc_settling_time(axis); });
  else if (measure == "overshoot")
    add_steps("", [](const Step& step, int axis) { return step.calc_overshoot(axis); });
  else if (measure == "tilt_max")
    values.emplace_back("tilt_max_rad", errors_.samples == 0.0 ? kNan : tilt_max_);
  else if (measure == "force_max")
    values.emplace_back("force_max_n",
                        errors_.samples == 0.0 ? kNan : std::sqrt(max_square_of_force_));
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
