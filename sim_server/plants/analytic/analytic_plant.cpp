#include "sim_server/plants/analytic/analytic_plant.hpp"

#include <Eigen/Geometry>

#include "common/model/dot.hpp"
#include "common/model/forces.hpp"

namespace sls::sim {

AnalyticPlant::AnalyticPlant(const model::SlungLoadParameters& vehicle, const config::Plant& plant)
    : vehicle_(vehicle),
      quad_air_(plant.air),
      air_(plant),
      load_wind_W_(plant.air.v_wind_W),
      disturbance_W_(plant.disturbance_W),
      step_s_(1e-9 * static_cast<double>(plant.step_ns)),
      total_mass_(vehicle.total_mass()),
      arm_(vehicle.rod_length * vehicle.load_mass / vehicle.total_mass()),
      inverse_inertia_(1.0 / (vehicle.quad_mass * vehicle.rod_length)) {
  const model::RodDirection rod = model::to_direction(plant.initial.rod);
  const bool is_load_placed = plant.initial.placed == config::Body::kLoad;
  const double to_centre = is_load_placed ? arm_ - vehicle.rod_length : arm_;
  motion_.p_WC = plant.initial.position + to_centre * rod.n_W;
  motion_.v_WC = plant.initial.v_WQ + arm_ * rod.n_dot_W;
  motion_.n_W = rod.n_W;
  motion_.w_W = rod.n_W.cross(rod.n_dot_W);
  measurement_ = measure(0, motion_);
}

AnalyticPlant::Motion AnalyticPlant::add(const Motion& motion, double h, const Motion& rate) {
  return {motion.p_WC + h * rate.p_WC, motion.v_WC + h * rate.v_WC, motion.n_W + h * rate.n_W,
          motion.w_W + h * rate.w_W};
}

AnalyticPlant::Motion AnalyticPlant::calc_rate(const Motion& motion,
                                               const Eigen::Vector3d& f_Q_W) const {
  const Eigen::Vector3d n_dot_W = motion.w_W.cross(motion.n_W);
  Eigen::Vector3d force_W = f_Q_W + disturbance_W_;
  if (quad_air_.rotor_drag != 0.0)
    force_W += model::calc_rotor_drag(f_Q_W, motion.v_WC - arm_ * n_dot_W, quad_air_);
  // Eqs. (1) and (2).
  Motion rate{motion.v_WC, force_W / total_mass_ + vehicle_.gravity * Eigen::Vector3d::UnitZ(),
              n_dot_W, -inverse_inertia_ * motion.n_W.cross(force_W)};
  if (air_.drags_load()) {
    const Eigen::Vector3d v_WL = motion.v_WC + (vehicle_.rod_length - arm_) * n_dot_W;
    const Eigen::Vector3d drag_W = air_.calc_load_drag(v_WL, load_wind_W_);
    rate.v_WC += drag_W / total_mass_;
    rate.w_W += motion.n_W.cross(drag_W) / (vehicle_.load_mass * vehicle_.rod_length);
  }
  return rate;
}

AnalyticPlant::Motion AnalyticPlant::calc_next(const Motion& start,
                                               const Eigen::Vector3d& f_Q_W) const {
  const double h = step_s_;
  const Motion k1 = calc_rate(start, f_Q_W);
  const Motion k2 = calc_rate(add(start, h / 2, k1), f_Q_W);
  const Motion k3 = calc_rate(add(start, h / 2, k2), f_Q_W);
  const Motion k4 = calc_rate(add(start, h, k3), f_Q_W);
  Motion next = add(add(add(add(start, h / 6, k1), h / 3, k2), h / 3, k3), h / 6, k4);
  // The step's errors in |n| = 1 and n·ω = 0, of order h⁵, are removed.
  next.n_W.normalize();
  next.w_W -= next.n_W * model::dot(next.n_W, next.w_W);
  return next;
}

void AnalyticPlant::advance(const std::vector<Eigen::Vector3d>& f_Q_W, std::int64_t steps) {
  check_finite(f_Q_W[0], steps_, "force_x_n", "force_y_n", "force_z_n");
  Motion motion = motion_;
  for (std::int64_t i = 0; i < steps; ++i) {
    if (air_.varies()) hold_wind(steps_ + i, motion);
    motion = calc_next(motion, f_Q_W[0]);
  }
  measurement_ = measure(steps_ + steps, motion);
  motion_ = motion;
  steps_ += steps;
}

void AnalyticPlant::hold_wind(std::int64_t step, const Motion& motion) {
  const double start = static_cast<double>(step) * step_s_;
  const model::SlungLoadState state = to_state(motion);
  quad_air_.v_wind_W = air_.calc_held_wind(start, step_s_, state.p_WQ, state.v_WQ);
  load_wind_W_ = air_.calc_held_wind(start, step_s_, state.p_WL, state.v_WL);
}

model::Measurement AnalyticPlant::measure(std::int64_t step, const Motion& motion) const {
  model::Measurement measured(to_state(motion));
  check_finite(measured, step);
  air_.add_signals(static_cast<double>(step) * step_s_, measured);
  return measured;
}

std::vector<Signal> AnalyticPlant::signals() const {
  std::vector<Signal> signals;
  air_.list_signals(signals);
  return signals;
}

model::SlungLoadState AnalyticPlant::to_state(const Motion& motion) const {
  model::RodDirection rod;
  rod.n_W = motion.n_W;
  rod.n_dot_W = motion.w_W.cross(motion.n_W);
  model::SlungLoadState state;
  state.p_WQ = motion.p_WC - arm_ * rod.n_W;
  state.v_WQ = motion.v_WC - arm_ * rod.n_dot_W;
  state.p_WL = state.p_WQ + vehicle_.rod_length * rod.n_W;
  state.v_WL = state.v_WQ + vehicle_.rod_length * rod.n_dot_W;
  state.rod = model::to_angles(rod);
  return state;
}

PlantType analytic_type() {
  return {Moves::kOneVehicle, [](const PlantSetup& setup) -> std::unique_ptr<Plant> {
            config::Plant plant = setup.plant;
            plant.initial = setup.vehicles[0].initial;
            return std::make_unique<AnalyticPlant>(setup.vehicles[0].parameters, plant);
          }};
}

}  // namespace sls::sim
