/// Conversions between wire types and the model's types.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/model/measurement.hpp"
#include "common/model/parameters.hpp"

namespace sls::bus {

inline std::array<double, 3> to_array(const Eigen::Vector3d& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

inline Eigen::Vector3d to_vector(const std::array<double, 3>& array) {
  return {array[0], array[1], array[2]};
}

inline model::Numbers to_numbers(const std::vector<double>& sequence) {
  return Eigen::Map<const Eigen::VectorXd>(sequence.data(),
                                           static_cast<Eigen::Index>(sequence.size()));
}

inline void fill(std::vector<double>& sequence, const model::Numbers& numbers) {
  sequence.assign(numbers.data(), numbers.data() + numbers.size());
}

inline void fill(VehicleParameters& message, const model::SlungLoadParameters& vehicle) {
  message.quad_mass_kg(vehicle.quad_mass);
  message.load_mass_kg(vehicle.load_mass);
  message.rod_length_m(vehicle.rod_length);
  message.gravity_m_s2(vehicle.gravity);
}

inline void fill(PlantState& message, const model::Measurement& state) {
  const Eigen::Quaterniond& q_WB = state.attitude.q_WB;
  message.p_WQ_m(to_array(state.p_WQ));
  message.v_WQ_m_s(to_array(state.v_WQ));
  message.q_WB({q_WB.w(), q_WB.x(), q_WB.y(), q_WB.z()});
  message.w_WB_B_rad_s(to_array(state.attitude.w_WB_B));
  message.p_WL_m(to_array(state.p_WL));
  message.v_WL_m_s(to_array(state.v_WL));
  message.alpha_rad(state.rod.alpha);
  message.beta_rad(state.rod.beta);
  message.alpha_dot_rad_s(state.rod.alpha_dot);
  message.beta_dot_rad_s(state.rod.beta_dot);
  fill(message.signals(), state.signals);
}

inline model::Measurement to_measurement(const PlantState& message) {
  const std::array<double, 4>& q_WB = message.q_WB();
  model::Measurement state;
  state.p_WQ = to_vector(message.p_WQ_m());
  state.v_WQ = to_vector(message.v_WQ_m_s());
  state.attitude.q_WB = Eigen::Quaterniond(q_WB[0], q_WB[1], q_WB[2], q_WB[3]);
  state.attitude.w_WB_B = to_vector(message.w_WB_B_rad_s());
  state.p_WL = to_vector(message.p_WL_m());
  state.v_WL = to_vector(message.v_WL_m_s());
  state.rod.alpha = message.alpha_rad();
  state.rod.beta = message.beta_rad();
  state.rod.alpha_dot = message.alpha_dot_rad_s();
  state.rod.beta_dot = message.beta_dot_rad_s();
  state.signals = to_numbers(message.signals());
  return state;
}

}  // namespace sls::bus
