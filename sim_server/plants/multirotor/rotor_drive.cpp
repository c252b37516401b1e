#include "sim_server/plants/multirotor/rotor_drive.hpp"

#include <algorithm>
#include <cmath>

#include "common/model/offset.hpp"
#include "sim_server/autopilots/rotor_wrenches.hpp"

namespace sls::sim {
namespace {

using Eigen::Vector3d, Eigen::VectorXd;

void check_output(const AutopilotOutput& wanted, std::int64_t step) {
  for (Eigen::Index i = 0; i < wanted.rotor_speeds.size(); ++i)
    if (!std::isfinite(wanted.rotor_speeds[i]))
      throw_not_finite("rotor_" + std::to_string(i + 1) + "_set_rad_s", step);
  if (!wanted.q_WB.coeffs().allFinite()) throw_not_finite("attitude set-point", step);
  if (!std::isfinite(wanted.thrust)) throw_not_finite("thrust_set_n", step);
  if (wanted.direction_W && !wanted.direction_W->allFinite())
    throw_not_finite("direction of the thrust", step);
}

}  // namespace

RotorDrive::RotorDrive(const AirframeKeys& keys, const PlantSetup& setup, std::size_t vehicle)
    : airframe_(make_airframe(keys, setup.vehicles[vehicle].parameters.quad_mass)),
      rotors_(make_rotors(keys)),
      step_s_(1e-9 * static_cast<double>(setup.plant.step_ns)),
      attitude_error_(model::turn(Eigen::Quaterniond::Identity(), setup.estimator.attitude)),
      watch_(rotors_.size(), setup.plant.step_ns) {
  for (const FlyingRotor& rotor : rotors_) {
    lags_.emplace_back(rotor, step_s_);
    own_scales_.push_back(rotor.thrust_scale);
  }
  if (setup.lacks_thrust) source_.emplace(setup, vehicle);
  AutopilotSetup given{setup.autopilot, setup.folder, setup.vehicles[vehicle].id,
                       setup.vehicles[vehicle].parameters, airframe_};
  if (given.autopilot.period_ns == 0) given.autopilot.period_ns = setup.plant.step_ns;
  autopilot_steps_ = given.autopilot.period_ns / setup.plant.step_ns;
  autopilot_ = make_autopilot(given);
  if (!has_yaw_authority(airframe_))
    watch_.add("the rotors have no authority over yaw: they cannot turn the vehicle about z alone");
}

void RotorDrive::start(double thrust) {
  state_.output.rotor_speeds = calc_equal_speeds(airframe_.rotors, thrust);
  state_.set_points = state_.output.rotor_speeds;
  limit(state_.set_points);
  state_.speeds = state_.set_points;
}

void RotorDrive::set_state(const State& state) {
  state_ = state;
  if (source_) source_->set_charge(state.charge);
}

/// What the rotors lack in the step that begins, and what they take from the battery.
void RotorDrive::scale_thrusts(std::int64_t step) {
  const double scale = source_->calc_scale(step);
  double thrust = 0.0;
  for (std::size_t i = 0; i < rotors_.size(); ++i) {
    rotors_[i].thrust_scale = scale * source_->calc_rotor_scale(step, i) * own_scales_[i];
    const double speed = state_.speeds[static_cast<Eigen::Index>(i)];
    thrust += calc_thrust(rotors_[i], {speed, speed * speed}, 0.0);
  }
  source_->discharge(thrust);
  state_.charge = source_->charge();
}

/// Clamps speeds to the limits of the rotors.
void RotorDrive::limit(VectorXd& wanted) const {
  for (std::size_t i = 0; i < rotors_.size(); ++i) {
    double& speed = wanted[static_cast<Eigen::Index>(i)];
    speed = std::max(rotors_[i].min_speed, std::min(rotors_[i].max_speed, speed));
  }
}

void RotorDrive::step(const Vector3d& f_Q_W, const Vector3d& v_WQ, const model::Attitude& attitude,
                      std::int64_t step) {
  AutopilotOutput& output = state_.output;
  if (step % autopilot_steps_ == 0) {
    AutopilotInput input;
    input.f_Q_W = f_Q_W;
    input.attitude = attitude;
    input.attitude.q_WB = attitude_error_ * input.attitude.q_WB;
    input.v_WQ = attitude_error_ * v_WQ;
    const AutopilotOutput& wanted = autopilot_->step(input);
    check_output(wanted, step);  // limit() would turn a NaN into the largest speed
    output = wanted;
    state_.set_points = output.rotor_speeds;
    limit(state_.set_points);
    // Rotors without a lag have the new speed at once, not at the end of the step.
    for (std::size_t i = 0; i < rotors_.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      state_.speeds[k] = lags_[i].begin(state_.speeds[k], state_.set_points[k]);
    }
    if (output.direction_W) output.direction_W = attitude_error_.conjugate() * *output.direction_W;
  }
  if (source_) scale_thrusts(step);
  watch_.look(rotors_, output.rotor_speeds, step, step_s_);
}

RotorLag::Stages RotorDrive::find_stages(std::size_t rotor, double speed, double h) const {
  if (h == step_s_) return find_stages(rotor, speed);
  return RotorLag(rotors_[rotor], h)
      .find_stages(speed, state_.set_points[static_cast<Eigen::Index>(rotor)]);
}

RotorLoads RotorDrive::calc_loads(const RotorSpeed* turning, const Vector3d& v_B,
                                  const Vector3d& w_B,
                                  const std::optional<Vector3d>& direction_B) const {
  RotorLoads loads;
  if (!direction_B) {
    for (std::size_t i = 0; i < rotors_.size(); ++i)
      add_loads(rotors_[i], turning[i], v_B + w_B.cross(rotors_[i].p_BR), loads);
    return loads;
  }
  // The autopilot turns the thrust instead of the body: all rotors act at the centre of mass.
  for (std::size_t i = 0; i < rotors_.size(); ++i) {
    FlyingRotor turned = rotors_[i];
    turned.p_BR = airframe_.p_BC;
    turned.axis_B = *direction_B;
    turned.torque_constant = turned.rolling_constant = 0.0;
    add_loads(turned, turning[i], v_B + w_B.cross(airframe_.p_BC), loads);
  }
  return loads;
}

std::vector<Signal> RotorDrive::list_signals() const {
  std::vector<Signal> signals;
  for (std::size_t i = 1; i <= size(); ++i)
    signals.push_back({"rotor_" + std::to_string(i) + "_rad_s", "rad/s"});
  for (std::size_t i = 1; i <= size(); ++i)
    signals.push_back({"rotor_" + std::to_string(i) + "_set_rad_s", "rad/s"});
  for (const char* name : {"att_set_w", "att_set_x", "att_set_y", "att_set_z"})
    signals.push_back({name, "1"});
  for (const char* name : {"thrust_set_n", "thrust_n"}) signals.push_back({name, "N"});
  if (source_) source_->list_signals(signals);
  return signals;
}

model::Numbers RotorDrive::calc_signals(double thrust, std::int64_t step) const {
  model::Numbers signals(2 * state_.speeds.size() + 6);
  const Eigen::Quaterniond& q = state_.output.q_WB;
  signals << state_.speeds, state_.set_points, q.w(), q.x(), q.y(), q.z(), state_.output.thrust,
      thrust;
  if (source_) source_->add_signals(step, signals);
  return signals;
}

}  // namespace sls::sim
