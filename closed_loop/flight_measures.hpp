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

namespace sls::closed_loop {

/// The measures of each flight of a campaign, and the stages of its base scenario.
class MeasureList {
 public:
  /// `names` are load_error_rms, load_error_max, settling, overshoot, tilt_max, force_max,
  /// time_of_loss and outcome. `outcome` is no number, so it has no column here.
  /// @throws config::ConfigError for another name.
  MeasureList(const config::Scenario& base, std::vector<std::string> names);

  const std::vector<std::string>& names() const { return names_; }
  /// For each stage: true if its reference is constant.
  const std::vector<bool>& stages() const { return stages_; }
  /// The columns of all measures, in order.
  const std::vector<std::string>& columns() const { return columns_; }

 private:
  std::vector<std::string> names_;
  std::vector<bool> stages_;
  std::vector<std::string> columns_;
};

class FlightMeasures {
 public:
  /// For a flight of one vehicle with this control period. `list` must outlive it.
  FlightMeasures(const MeasureList& list, std::int64_t period_ns);

  /// Adds a step, in order from step 0.
  void add(const model::StepRecord& step);

  /// A value for each column of the list; NaN if it is not defined.
  std::vector<double> finish(std::optional<double> time_of_loss_s) const;

 private:
  friend class MeasureList;
  using NamedValue = std::pair<std::string, double>;

  /// Load position error over a part of the flight.
  struct Errors {
    void add(const Eigen::Array3d& error);
    Eigen::Array3d calc_rms() const;
    Eigen::Array3d calc_max() const;
    double calc_norm_rms() const;
    double calc_norm_max() const;

    double samples = 0.0;
    Eigen::Array3d sum_of_squares = Eigen::Array3d::Zero();  // m²
    Eigen::Array3d max_square = Eigen::Array3d::Zero();      // m²
    double max_square_of_norm = 0.0;                         // m²
  };

  /// Step response of the load to a constant reference, per axis.
  struct Step {
    void add(const model::StepRecord& step, double time_s);
    double calc_settling_time(int axis) const;
    double calc_overshoot(int axis) const;
    bool is_step(int axis) const;

    bool has_begun = false;
    bool is_constant = true;
    double start_s = 0.0;
    Eigen::Array3d target = Eigen::Array3d::Zero();           // m
    Eigen::Array3d size = Eigen::Array3d::Zero();             // d, m
    Eigen::Array3d settled_since_s = Eigen::Array3d::Zero();  // NaN: outside the band
    Eigen::Array3d overshoot = Eigen::Array3d::Zero();
  };

  std::vector<NamedValue> list_values(const std::string& measure,
                                      std::optional<double> time_of_loss_s) const;

  const MeasureList& list_;
  const std::int64_t period_ns_;
  Errors errors_;
  std::vector<Errors> stages_;
  std::vector<Step> steps_;           // by stage; only those with a constant reference are used
  double tilt_max_ = 0.0;             // rad
  double max_square_of_force_ = 0.0;  // N²
};

}  // namespace sls::closed_loop
