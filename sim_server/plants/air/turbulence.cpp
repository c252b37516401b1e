#include "sim_server/plants/air/turbulence.hpp"

#include <cmath>
#include <stdexcept>

#include "common/model/dice.hpp"
#include "common/model/dot.hpp"
#include "common/model/math.hpp"

namespace sls::sim {

using Eigen::Vector2d, Eigen::Vector3d;

namespace {

constexpr double kReach = config::Turbulence::kReach;
constexpr double kFoot = 0.3048;  // m

double power(double base, double exponent) { return math::exp(exponent * math::log(base)); }

}  // namespace

DrydenParameters calc_dryden_parameters(const config::Turbulence& turbulence) {
  const double feet = turbulence.altitude / kFoot;
  const double decay = 0.177 + 0.000823 * feet;
  const double level = turbulence.altitude / power(decay, 1.2);
  const double down = 0.1 * turbulence.w20;
  const double aside = down / power(decay, 0.4);
  return {{level, level, turbulence.altitude}, {aside, aside, down}};
}

Turbulence::Turbulence(const config::Turbulence& turbulence, const Vector3d& v_wind_W)
    : seed_(turbulence.seed),
      speed_(std::sqrt(v_wind_W.head<2>().squaredNorm())),
      along_W_(v_wind_W.x() / speed_, v_wind_W.y() / speed_, 0.0),
      parameters_(calc_dryden_parameters(turbulence)),
      spacing_(0.02 * parameters_.length.minCoeff()),
      next_(-static_cast<std::int64_t>(std::ceil(kReach / spacing_))) {
  // Exact steps of the filters: eqs. (7) and (8), with unit variance of the outputs.
  for (int i = 0; i < 3; ++i) kept_[i] = math::exp(-spacing_ / parameters_.length[i]);
  for (int i = 0; i < 2; ++i) {
    const double step = spacing_ / parameters_.length[1 + i], kept = kept_[1 + i] * kept_[1 + i];
    const double of_first = 0.5 * (1.0 - kept);
    const double of_both = 0.25 - kept * (0.25 + 0.5 * step);
    const double of_second = 0.25 - kept * (0.25 + 0.5 * step + 0.5 * step * step);
    first_[i] = std::sqrt(of_first);
    mixed_[i] = of_both / first_[i];
    second_[i] = std::sqrt(of_second - mixed_[i] * mixed_[i]);
  }
  // It begins as it goes on: variances 1; 1/2 and 1/4 with covariance 1/4.
  const model::Dice dice(seed_, 1, 0);
  filters_.along = dice.calc_normal(0);
  for (int i = 0; i < 2; ++i) {
    const double a = dice.calc_normal(1 + 2 * i), b = dice.calc_normal(2 + 2 * i);
    filters_.first[i] = std::sqrt(0.5) * a;
    filters_.second[i] = std::sqrt(0.125) * (a + b);
  }
}

Vector3d Turbulence::extend() {
  const model::Dice dice(seed_, 0, static_cast<std::uint64_t>(next_++));
  filters_.along =
      kept_[0] * filters_.along + std::sqrt(1.0 - kept_[0] * kept_[0]) * dice.calc_normal(0);
  Vector3d unit(filters_.along, 0.0, 0.0);
  const double root = std::sqrt(3.0);
  for (int i = 0; i < 2; ++i) {
    const double a = dice.calc_normal(1 + 2 * i), b = dice.calc_normal(2 + 2 * i);
    double &first = filters_.first[i], &second = filters_.second[i];
    const double step = spacing_ / parameters_.length[1 + i];
    second = kept_[1 + i] * (second + step * first) + mixed_[i] * a + second_[i] * b;
    first = kept_[1 + i] * first + first_[i] * a;
    unit[1 + i] = root * first + (1.0 - root) * second;
  }
  return parameters_.deviation.cwiseProduct(unit);
}

Vector3d Turbulence::at(double way) {
  const double place = std::floor(way / spacing_);
  const auto index = static_cast<std::int64_t>(place);
  while (next_ <= index + 1) computed_.push_back(extend());
  const auto most = static_cast<std::size_t>(2.0 * kReach / spacing_) + 3;
  while (computed_.size() > most) computed_.pop_front();
  const std::int64_t from_end = next_ - index;  // 2 or more
  const auto at = computed_.end() - from_end;
  const double share = way / spacing_ - place;
  return at[0] + share * (at[1] - at[0]);
}

Vector3d Turbulence::at(double time, const Vector3d& p_W) {
  const double along = model::dot(along_W_, p_W);
  if (!(std::abs(along) <= kReach))
    throw std::runtime_error(
        "turbulence: expected bodies within 500 m of the origin along the "
        "wind, got one further away");
  const Vector3d own = at(speed_ * time - along);
  const Vector3d across_W(-along_W_.y(), along_W_.x(), 0.0);
  return own.x() * along_W_ + own.y() * across_W + own.z() * Vector3d::UnitZ();
}

}  // namespace sls::sim
