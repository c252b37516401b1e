#include "sim_server/plants/air/air.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace sls::sim {
namespace {

using Eigen::Vector3d;

/// Share of a gust that blows, 0 to 1: eq. (5).
double calc_share(const config::Gust& gust, double time) {
  const auto seconds = [](std::int64_t ns) { return 1e-9 * static_cast<double>(ns); };
  const double since = time - seconds(gust.at_ns), rise = seconds(gust.rise_ns);
  if (!(since >= 0.0)) return 0.0;
  const double come = since < rise ? since / rise : 1.0;
  if (!gust.for_ns) return come;
  const double over = since - seconds(*gust.for_ns);
  if (!(over >= 0.0)) return come;
  const double went = over < rise ? over / rise : 1.0;
  return std::max(0.0, come - went);
}

}  // namespace

Air::Air(const config::Plant& plant)
    : mean_W_(plant.air.v_wind_W), wind_(plant.wind), drag_(plant.load_drag) {
  if (wind_.turbulence) turbulence_.emplace(*wind_.turbulence, mean_W_);
}

Vector3d Air::calc_wind(double time, const Vector3d& p_W) const {
  Vector3d wind_W = mean_W_;
  for (const config::Gust& gust : wind_.gusts) wind_W += calc_share(gust, time) * gust.v_wind_W;
  if (turbulence_) wind_W += turbulence_->at(time, p_W);
  return wind_W;
}

void Air::list_signals(std::vector<Signal>& signals) const {
  if (varies())
    for (const char* name : {"wind_x_m_s", "wind_y_m_s", "wind_z_m_s"})
      signals.push_back({name, "m/s"});
  if (drags_load())
    for (const char* name : {"load_drag_x_n", "load_drag_y_n", "load_drag_z_n"})
      signals.push_back({name, "N"});
}

void Air::add_signals(double time, const Vector3d& p_WQ, const Vector3d& p_WL, const Vector3d& v_WL,
                      model::Numbers& signals) const {
  const auto add = [&signals](const Vector3d& v) {
    if (!v.allFinite())
      throw std::runtime_error("the wind, or the drag of the load, is not finite");
    signals.conservativeResize(signals.size() + 3);
    signals.tail<3>() = v;
  };
  if (varies()) add(calc_wind(time, p_WQ));
  if (drags_load()) add(calc_load_drag(v_WL, calc_wind(time, p_WL)));
}

}  // namespace sls::sim
