#include "sim_server/plants/cables/flying_rotors.hpp"

namespace sls::sim::cables {

using Eigen::Matrix3d, Eigen::Vector3d;

model::Attitude to_attitude(const Turn& turn) {
  const Eigen::Vector4d& q = turn.q_WB;
  return {Eigen::Quaterniond(q[0], q[1], q[2], q[3]), turn.w_WB_B};
}

FlyingRotors::FlyingRotors(const AirframeKeys& keys, const PlantSetup& setup, HybridMotion& motion)
    : torque_W_(keys.disturbance_torque) {
  v_wind_W_.fill(setup.plant.air.v_wind_W);
  for (std::size_t i = 0; i < setup.vehicles.size(); ++i) {
    RotorDrive& drive = drives_.emplace_back(keys, setup, i);
    const model::SlungLoadParameters& vehicle = setup.vehicles[i].parameters;
    double carried = vehicle.quad_mass;
    if (motion.taut().has(i)) carried += vehicle.load_mass;
    if (motion.standing().has(i)) carried = 0.0;
    drive.start(carried * vehicle.gravity);
    for (const double speed : drive.state().speeds)
      motion.rotors().push_back({speed, speed * speed});
  }
}

void FlyingRotors::begin_step(const Vectors& f_Q_W, std::int64_t step, HybridMotion& motion) {
  auto rotor = motion.rotors().begin();
  for (std::size_t i = 0; i < drives_.size(); ++i) {
    const Motion& now = motion.motion();
    drives_[i].step(f_Q_W[i], now.vehicles[i].v_W, to_attitude(now.turns[i]), step);
    for (const double speed : drives_[i].state().speeds) *rotor++ = {speed, speed * speed};
  }
}

void FlyingRotors::end_step(const HybridMotion& motion) {
  auto rotor = motion.rotors().begin();
  for (RotorDrive& drive : drives_)
    for (std::size_t k = 0; k < drive.size(); ++k) drive.set_speed(k, (rotor++)->speed);
}

void FlyingRotors::turn(const RotorSpeeds& start, double h, RotorSpeeds& middle, RotorSpeeds& end,
                        RotorSpeeds& after) const {
  for (RotorSpeeds* speeds : {&middle, &end, &after}) speeds->resize(start.size());
  std::size_t at = 0;
  for (const RotorDrive& drive : drives_)
    for (std::size_t k = 0; k < drive.size(); ++k, ++at) {
      const RotorLag::Stages stages = drive.find_stages(k, start[at].speed, h);
      middle[at] = stages.middle;
      end[at] = stages.end;
      after[at] = {stages.end.speed, stages.end.speed * stages.end.speed};
    }
}

RotorLoads FlyingRotors::calc_loads(std::size_t vehicle, const Motion& motion,
                                    const RotorSpeeds& speeds, const Matrix3d& R_WB) const {
  const RotorDrive& drive = drives_[vehicle];
  std::optional<Vector3d> direction_B;
  if (const auto& direction_W = drive.state().output.direction_W)
    direction_B = R_WB.transpose() * *direction_W;
  return drive.calc_loads(speeds.data() + vehicle * drive.size(),
                          R_WB.transpose() * (motion.vehicles[vehicle].v_W - v_wind_W_[vehicle]),
                          motion.turns[vehicle].w_WB_B, direction_B);
}

void FlyingRotors::push(const Motion& motion, const RotorSpeeds& speeds, Actions& actions) const {
  for (std::size_t i = 0; i < drives_.size(); ++i) {
    const Matrix3d R_WB = calc_rotation(motion.turns[i].q_WB);
    const RotorLoads loads = calc_loads(i, motion, speeds, R_WB);
    actions.f_Q_W[i] = R_WB * loads.force_B;
    actions.torque_B[i] = loads.torque_B + R_WB.transpose() * torque_W_;
  }
}

model::Numbers FlyingRotors::calc_signals(std::size_t vehicle, const HybridMotion& motion,
                                          std::int64_t step) const {
  const Matrix3d R_WB = calc_rotation(motion.motion().turns[vehicle].q_WB);
  const RotorLoads loads = calc_loads(vehicle, motion.motion(), motion.rotors(), R_WB);
  return drives_[vehicle].calc_signals(loads.thrust, step);
}

}  // namespace sls::sim::cables
