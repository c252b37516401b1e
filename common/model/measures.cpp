#include "common/model/measures.hpp"

#include <algorithm>

#include "common/model/dot.hpp"
#include "common/model/math.hpp"

namespace sls::model {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

double ErrorStatistics::calc_rms(int component) const {
  if (samples_ == 0) return kNan;
  const double sum = component == kNorm ? sum_of_squares_.sum() : sum_of_squares_[component];
  return std::sqrt(sum / static_cast<double>(samples_));
}

double ErrorStatistics::calc_max(int component) const {
  return component == kNorm ? std::sqrt(largest_square_.value())
                            : largest_[static_cast<std::size_t>(component)].value();
}

std::uint64_t ErrorStatistics::find_worst(int component) const {
  return component == kNorm ? largest_square_.sample()
                            : largest_[static_cast<std::size_t>(component)].sample();
}

double ErrorStatistics::calc_end(int component) const {
  return component == kNorm ? last_.norm() : std::abs(last_[component]);
}

double Settling::calc_time() const {
  const bool is_short = std::isfinite(hold_s_) && !is_held_;
  return (is_short ? kInfinity : since_s_) - start_s_;
}

double StepResponse::calc_settling_time() const {
  return size_ < kLeastStep ? kNan : settling_.calc_time();
}

double StepResponse::calc_overshoot() const {
  return size_ < kLeastStep ? kNan : std::max(0.0, beyond_.value() / size_);
}

void StepResponses::add(double time_s, const Eigen::Vector3d& error) {
  if (!has_begun_) {
    has_begun_ = true;
    for (int axis = 0; axis < 3; ++axis) {
      signs_[axis] = error[axis] > 0.0 ? -1.0 : 1.0;
      responses_[static_cast<std::size_t>(axis)] = StepResponse(std::abs(error[axis]));
    }
    responses_[kNorm] = StepResponse(error.norm());
    direction_ = -error.stableNormalized();
  }
  for (int axis = 0; axis < 3; ++axis)
    responses_[static_cast<std::size_t>(axis)].add(time_s, std::abs(error[axis]),
                                                   error[axis] * signs_[axis]);
  responses_[kNorm].add(time_s, error.norm(), dot(error, direction_));
}

Eigen::Vector3d calc_steady_state_error(
    const Eigen::Ref<const Eigen::VectorXd>& time_s,
    const Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>& errors) {
  const double end = time_s[time_s.size() - 1];
  const double begin = end - 0.1 * (end - time_s[0]);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double samples = 0.0;
  for (Eigen::Index row = 0; row < time_s.size(); ++row) {
    if (time_s[row] < begin) continue;
    sum += errors.row(row);
    samples += 1.0;
  }
  return sum / samples;
}

Eigen::Vector3d calc_quad_reference(const Reference& reference,
                                    const SlungLoadParameters& vehicle) {
  const Eigen::Vector3d tension =
      vehicle.gravity * Eigen::Vector3d::UnitZ() - reference.acceleration;  // over m_L
  return reference.position - vehicle.rod_length / tension.norm() * tension;
}

double calc_rod_tilt(const Eigen::Vector3d& p_QL_W) {
  return math::atan2(p_QL_W.head<2>().norm(), p_QL_W.z());
}

double calc_body_tilt(const Eigen::Quaterniond& q_WB) {
  return 2.0 * math::atan2(q_WB.vec().head<2>().norm(), math::hypot(q_WB.w(), q_WB.z()));
}

}  // namespace sls::model
