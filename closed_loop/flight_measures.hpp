/// Measures of a flight for a campaign, collected during the flight without storing it.
/// README.md, "Measures".
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "closed_loop/flight.hpp"
#include "common/config/scenario.hpp"
#include "common/model/measures.hpp"

namespace sls::closed_loop {

/// The measures of each flight of a campaign, and the stages of its base scenario.
class MeasureList {
 public:
  /// `names` are those of the table in README.md. `outcome` is no number, so it has no column here.
  /// @throws config::ConfigError for another name.
  MeasureList(const config::Scenario& base, std::vector<std::string> names);

  const std::vector<std::string>& names() const { return names_; }
  /// For each stage: true if its reference is constant.
  const std::vector<bool>& stages() const { return stages_; }
  /// The columns of all measures, in order.
  const std::vector<std::string>& columns() const { return columns_; }
  /// True if `name` is a measure of the list, or the beginning of one.
  bool has(const std::string& name) const;

 private:
  std::vector<std::string> names_;
  std::vector<bool> stages_;
  std::vector<std::string> columns_;
};

class FlightMeasures {
 public:
  /// For a flight of `vehicle`, alone, with this control period. `list` must outlive it. Without
  /// `has_attitude` the measures of the attitude are not defined.
  FlightMeasures(const MeasureList& list, std::int64_t period_ns,
                 const model::SlungLoadParameters& vehicle, bool has_attitude);

  /// Adds a step, in order from step 0.
  void add(const model::StepRecord& step);

  /// A value for each column of the list; NaN if it is not defined.
  std::vector<double> finish(std::optional<double> time_of_loss_s) const;

 private:
  friend class MeasureList;
  using NamedValue = std::pair<std::string, double>;

  /// Position errors over a part of the flight.
  struct Errors {
    model::ErrorStatistics load, quad;
  };

  /// Step response of the load to a constant reference.
  struct Step {
    void add(const model::StepRecord& step, double time_s);

    bool has_begun = false;
    bool is_constant = true;
    Eigen::Vector3d target = Eigen::Vector3d::Zero();  // m
    model::StepResponses responses;
  };

  std::vector<NamedValue> list_values(const std::string& measure,
                                      std::optional<double> time_of_loss_s) const;

  const MeasureList& list_;
  const std::int64_t period_ns_;
  const bool has_quad_errors_, has_energy_;
  const model::SlungLoadParameters vehicle_;
  const bool has_attitude_;
  Errors errors_;
  std::vector<Errors> stages_;
  std::vector<Step> steps_;  // by stage; only those with a constant reference are used
  model::Largest tilt_, attitude_, squared_force_, energy_;
};

}  // namespace sls::closed_loop
