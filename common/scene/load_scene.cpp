#include "common/scene/load_scene.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/config/config_error.hpp"
#include "common/config/scenario.hpp"
#include "common/model/dot.hpp"
#include "common/model/math.hpp"

namespace sls::scene {
namespace {

using Points = std::vector<Eigen::Vector3d>;

/// The points in turn around their mean, in the plane that fits them best.
Points sort_around(Points points) {
  if (points.size() < 3) return points;
  const auto count = static_cast<Eigen::Index>(points.size());
  Eigen::Matrix3Xd offsets(3, count);
  for (Eigen::Index i = 0; i < count; ++i) offsets.col(i) = points[static_cast<std::size_t>(i)];
  const Eigen::Vector3d mean = offsets.rowwise().mean();
  offsets.colwise() -= mean;
  // The normal of the plane comes first. Not computeDirect, which calls the C library's atan2.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(offsets * offsets.transpose());
  const auto calc_angle = [&](const Eigen::Vector3d& point) {
    return math::atan2(model::dot(axes.eigenvectors().col(1), point - mean),
                       model::dot(axes.eigenvectors().col(2), point - mean));
  };
  std::stable_sort(points.begin(), points.end(),
                   [&](const auto& a, const auto& b) { return calc_angle(a) < calc_angle(b); });
  return points;
}

double sinh(double x) {
  const double m = math::expm1(x);
  return 0.5 * (m + m / (m + 1.0));
}
double cosh(double x) {
  const double m = math::expm1(x);
  return 1.0 + 0.5 * m * m / (m + 1.0);
}
double asinh(double x) { return std::copysign(math::log(std::abs(x) + std::sqrt(x * x + 1.0)), x); }
double atanh(double x) { return 0.5 * math::log((1.0 + x) / (1.0 - x)); }

/// x > 0 with sinh(x) / x = ratio, for ratio > 1. Newton's method from above the root, where the
/// function is convex.
double invert_sinh_ratio(double ratio) {
  const double size = math::log(2.0 * ratio);
  double x = ratio < 3.0 ? std::sqrt(6.0 * (ratio - 1.0)) : size + 1.2 * math::log(size);
  for (int i = 0; i < 20; ++i) x -= (sinh(x) - ratio * x) / std::max(cosh(x) - ratio, 1e-300);
  return x;
}

}  // namespace

std::optional<LoadScene> read_load_scene(const Parameters& parameters) try {
  const config::Scenario scenario =
      config::parse_scenario(parameters.scenario_text().to_string(), "scenario of the run");
  if (!scenario.shared_load) return std::nullopt;
  const model::SharedLoad& load = *scenario.shared_load;
  LoadScene scene;
  double mass = 0.0;
  for (std::size_t i = 0; i < load.cables.size(); ++i) {
    scene.attachments_L[static_cast<std::uint32_t>(i)] = load.cables[i].attachment_L;
    if (load.inertia_L) scene.outline_L.push_back(load.cables[i].attachment_L);
    mass += load.cables[i].load_share;
  }
  scene.outline_L = sort_around(scene.outline_L);
  scene.full_tension =
      2.0 * mass * scenario.vehicle.gravity / static_cast<double>(load.cables.size());
  scene.ground_z_W = load.ground_z_W;
  for (std::size_t i = 0; i < parameters.signals().size(); ++i)
    if (parameters.signals()[i].name() == "cable_released") scene.released_signal = i;
  return scene;
} catch (const config::ConfigError&) {
  return std::nullopt;
}

std::optional<Cable> read_cable(const LoadScene& scene, const std::vector<double>& signals) {
  using Signal = model::SharedLoad::Signal;
  if (signals.size() < Signal::kSignals) return std::nullopt;
  Cable cable;
  cable.tension = signals[Signal::kTension];
  cable.length = signals[Signal::kLength];
  cable.is_taut = signals[Signal::kTaut] != 0.0;
  const double* q = &signals[Signal::kAttitude];
  cable.q_WL = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  cable.w_WL_L = Eigen::Map<const Eigen::Vector3d>(&signals[Signal::kRates]);
  cable.is_released = scene.released_signal && *scene.released_signal < signals.size() &&
                      signals[*scene.released_signal] != 0.0;
  return cable;
}

Colour calc_colour(const LoadScene& scene, const Cable& cable) {
  if (!cable.is_taut) return kSlackColour;
  const auto part = static_cast<float>(std::clamp(cable.tension / scene.full_tension, 0.0, 1.0));
  Colour colour;
  for (std::size_t i = 0; i < colour.size(); ++i)
    colour[i] = kLowColour[i] + part * (kHighColour[i] - kLowColour[i]);
  return colour;
}

Points calc_cable_points(const LoadScene& scene, const Cable& cable,
                         const Eigen::Vector3d& vehicle_W, const Eigen::Vector3d& end_W) {
  if (cable.is_taut) return {vehicle_W, end_W};
  Points points = calc_hanging_points(vehicle_W, end_W, cable.length);
  if (scene.ground_z_W)
    for (Eigen::Vector3d& point : points) point.z() = std::min(point.z(), *scene.ground_z_W);
  return points;
}

/// With heights y upwards along x of the vertical plane: y = a cosh((x − x₀) / a), and the length
/// from the lowest point is s = a sinh((x − x₀) / a), so y = √(a² + s²). For ends h apart and v
/// higher, sinh(h / 2a) / (h / 2a) = √(L² − v²) / h, and tanh((h / 2 − x₀) / a) = v / L.
Points calc_hanging_points(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double length) {
  constexpr double kLeastWidth = 1e-3;  // of the length: narrower ones are drawn like this
  const Eigen::Vector3d along = to - from;
  const double rise = -along.z();  // z is down
  const double width = std::max(along.head<2>().norm(), kLeastWidth * length);
  const double ratio = std::sqrt(std::max(length * length - rise * rise, 0.0)) / width;
  if (!(ratio > 1.0 + 1e-9)) return {from, to};
  const double a = 0.5 * width / invert_sinh_ratio(ratio);
  const double x_0 = 0.5 * width - a * atanh(rise / length);
  const double s_0 = -a * sinh(x_0 / a);  // at `from`
  constexpr int kParts = kHangingPoints - 1;
  // The point next to the lowest one is moved there, if it is between the ends.
  const double place = -s_0 / length * kParts;
  const double lowest =
      place > 0.0 && place < kParts ? std::clamp(std::round(place), 1.0, kParts - 1.0) : 0.0;
  Points points = {from};
  for (int i = 1; i < kParts; ++i) {
    const double s = i == lowest ? 0.0 : s_0 + length * i / kParts;
    const double part = (x_0 + a * asinh(s / a)) / width;
    const double height = std::sqrt(a * a + s * s) - std::sqrt(a * a + s_0 * s_0);
    points.emplace_back(from.x() + part * along.x(), from.y() + part * along.y(),
                        from.z() - height);
  }
  points.push_back(to);
  return points;
}

}  // namespace sls::scene
