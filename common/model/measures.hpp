/// Accumulators and formulas of a flight's measures. Campaigns, flight.txt, reports and checks all
/// compute with these. Definitions: README.md, "Measures".
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/model/parameters.hpp"
#include "common/model/reference.hpp"

namespace sls::model {

/// Components of a vector for which a measure exists: x, y, z, and its length.
inline constexpr int kNorm = 3;
inline constexpr int kComponents = 4;

/// A step smaller than this has no step response, m.
inline constexpr double kLeastStep = 0.01;
/// Settled: within this share of the step.
inline constexpr double kSettlingBand = 0.02;

/// The largest of some numbers, and the sample at which it came first. NaN without numbers; a NaN
/// among numbers is ignored.
class Largest {
 public:
  void add(double number, std::uint64_t sample) {
    if (number <= value_ || std::isnan(number)) return;
    value_ = number;
    sample_ = sample;
  }
  double value() const { return value_; }
  std::uint64_t sample() const { return sample_; }

 private:
  double value_ = std::numeric_limits<double>::quiet_NaN();
  std::uint64_t sample_ = 0;
};

/// Statistics of a vector over a part of a flight, such as a position error (m). Each function is
/// of one component (0, 1, 2, or kNorm) and NaN without samples. Samples count from 0.
class ErrorStatistics {
 public:
  void add(const Eigen::Vector3d& error) {
    const Eigen::Array3d squares = error.array().square();
    sum_of_squares_ += squares;
    for (int axis = 0; axis < 3; ++axis)
      largest_[static_cast<std::size_t>(axis)].add(std::abs(error[axis]), samples_);
    largest_square_.add(squares.sum(), samples_);
    last_ = error;
    ++samples_;
  }

  std::uint64_t samples() const { return samples_; }
  double calc_rms(int component) const;
  /// Largest size, and the sample at which it came first.
  double calc_max(int component) const;
  std::uint64_t find_worst(int component) const;
  /// Size at the last sample.
  double calc_end(int component) const;

 private:
  std::uint64_t samples_ = 0;
  Eigen::Array3d sum_of_squares_ = Eigen::Array3d::Zero();
  std::array<Largest, 3> largest_;
  Largest largest_square_;  // of the length
  Eigen::Vector3d last_ = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
};

/// When a distance became small and stayed so. Samples come in order of time.
class Settling {
 public:
  /// Settled: at most `band` from a sample on, for `hold_s` or, if that is infinite, to the end.
  explicit Settling(double band, double hold_s = std::numeric_limits<double>::infinity())
      : band_(band), hold_s_(hold_s) {}

  void add(double time_s, double distance) {
    if (samples_ == 0) start_s_ = time_s;
    if (!is_held_) {
      if (!(distance <= band_)) {
        since_s_ = std::numeric_limits<double>::infinity();
      } else if (std::isinf(since_s_)) {
        since_s_ = time_s;
        sample_ = samples_;
      }
      is_held_ = time_s - since_s_ >= hold_s_;
    }
    ++samples_;
  }

  /// From the first sample on, s; infinite: not settled; NaN without samples.
  double calc_time() const;
  std::uint64_t samples() const { return samples_; }
  /// The sample at that time, counted from 0.
  std::uint64_t sample() const { return sample_; }

 private:
  double band_, hold_s_;
  bool is_held_ = false;
  std::uint64_t samples_ = 0, sample_ = 0;
  double start_s_ = std::numeric_limits<double>::quiet_NaN();
  double since_s_ = std::numeric_limits<double>::infinity();
};

/// Response to a step: of one axis, or along the line from the start to the target.
class StepResponse {
 public:
  /// `size`: distance of the start from the target, ≥ 0.
  explicit StepResponse(double size = 0.0) : size_(size), settling_(kSettlingBand * size) {}

  /// `beyond`: how far behind the target, seen from the start; of either sign.
  void add(double time_s, double distance, double beyond) {
    beyond_.add(beyond, settling_.samples());
    settling_.add(time_s, distance);
  }

  /// NaN if there is no step.
  double calc_settling_time() const;
  /// As a share of the step; NaN if there is none.
  double calc_overshoot() const;
  const Settling& settling() const { return settling_; }
  const Largest& beyond() const { return beyond_; }

 private:
  double size_;
  Settling settling_;
  Largest beyond_;
};

/// The four responses of a position to a constant target.
class StepResponses {
 public:
  /// `error`: position minus target, m.
  void add(double time_s, const Eigen::Vector3d& error);
  const StepResponse& operator[](int component) const {
    return responses_[static_cast<std::size_t>(component)];
  }

 private:
  bool has_begun_ = false;
  Eigen::Vector3d direction_ = Eigen::Vector3d::Zero();  // of the step; of length 1
  Eigen::Vector3d signs_ = Eigen::Vector3d::Zero();      // of its components
  std::array<StepResponse, kComponents> responses_;
};

/// Mean of the rows of `errors` (n×3) in the last tenth of the time; n > 0.
Eigen::Vector3d calc_steady_state_error(
    const Eigen::Ref<const Eigen::VectorXd>& time_s,
    const Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>& errors);

/// Where the quadrotor is while the load follows `reference` exactly, m: eq. (10). NaN if the load
/// then falls freely.
Eigen::Vector3d calc_quad_reference(const Reference& reference, const SlungLoadParameters& vehicle);

/// Angle between the rod `p_QL_W` and straight down, rad, in [0, π].
double calc_rod_tilt(const Eigen::Vector3d& p_QL_W);

/// Angle between the body's z axis and straight down, rad, in [0, π].
double calc_body_tilt(const Eigen::Quaterniond& q_WB);

}  // namespace sls::model
