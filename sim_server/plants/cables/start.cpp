#include "sim_server/plants/cables/start.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "sim_server/plants/inertia.hpp"
#include "sim_server/plants/multirotor/airframe.hpp"

namespace sls::sim::cables {
namespace {

using Eigen::Vector3d;

/// The cable of a vehicle at the start.
struct Placed {
  model::RodDirection rod;
  double distance;  // m
  Vector3d p_LE_W;  // its end, from the load's centre
  Vector3d p_WE;    // its end
};

Placed place_cable(const CablesKeys& keys, const PlantSetup::Vehicle& vehicle, std::size_t index) {
  const CableKeys cable = get_cable(keys, index);
  model::RodAngles angles = vehicle.initial.rod;
  angles.alpha = cable.alpha.value_or(angles.alpha);
  angles.beta = cable.beta.value_or(angles.beta);
  angles.alpha_dot = cable.alpha_dot.value_or(angles.alpha_dot);
  angles.beta_dot = cable.beta_dot.value_or(angles.beta_dot);
  Placed placed;
  placed.rod = model::to_direction(angles);
  placed.distance = cable.distance.value_or(vehicle.parameters.rod_length);
  placed.p_LE_W = cable.attachment;
  if (keys.load_attitude) placed.p_LE_W = keys.load_attitude->toRotationMatrix() * cable.attachment;
  placed.p_WE = vehicle.initial.position;
  if (vehicle.initial.placed == config::Body::kQuadrotor)
    placed.p_WE += placed.distance * placed.rod.n_W;
  return placed;
}

}  // namespace

Vector3d calc_load_centre(const CablesKeys& keys, const PlantSetup::Vehicle& vehicle,
                          std::size_t index) {
  const Placed placed = place_cable(keys, vehicle, index);
  return placed.p_WE - placed.p_LE_W;
}

Start make_start(const CablesKeys& keys, const std::vector<PlantSetup::Vehicle>& vehicles) {
  Start start;
  System& system = start.system;
  system.count = vehicles.size();
  system.gravity = vehicles[0].parameters.gravity;
  system.restitution = keys.restitution;
  system.ground_z_W = keys.ground_z;
  if (keys.load_inertia) {
    system.is_rigid = true;
    system.inertia_L = make_inertia(*keys.load_inertia, keys.load_products);
    system.inverse_inertia_L = system.inertia_L.inverse();
  }
  if (keys.airframe) {
    system.has_attitude = true;  // without fixed bodies the inertia does not depend on the mass
    system.vehicle_inertia_B =
        make_airframe(*keys.airframe, vehicles[0].parameters.quad_mass).inertia_C_B;
    system.inverse_vehicle_inertia_B = system.vehicle_inertia_B.inverse();
  }
  const Eigen::Quaterniond attitude =
      keys.load_attitude.value_or(Eigen::Quaterniond(1.0, 0.0, 0.0, 0.0));
  const Vector3d w_W = attitude.toRotationMatrix() * keys.load_rates;

  Motion& motion = start.motion;
  const Placed first = place_cable(keys, vehicles[0], 0);
  motion.p_WL = first.p_WE - first.p_LE_W;
  motion.v_WL =
      vehicles[0].initial.v_WQ + first.distance * first.rod.n_dot_W - w_W.cross(first.p_LE_W);
  motion.q_WL << attitude.w(), attitude.x(), attitude.y(), attitude.z();
  motion.w_WL_L = keys.load_rates;
  system.load_mass = 0.0;
  for (std::size_t i = 0; i < system.count; ++i) {
    const Placed placed = place_cable(keys, vehicles[i], i);
    system.load_mass += vehicles[i].parameters.load_mass;
    system.vehicle_mass[i] = vehicles[i].parameters.quad_mass;
    const CableKeys cable = get_cable(keys, i);
    system.attachment_L[i] = cable.attachment;
    system.stiffness[i] = cable.stiffness.value_or(0.0);
    system.damping[i] = cable.damping;
    motion.vehicles[i] = {
        motion.p_WL + placed.p_LE_W - placed.distance * placed.rod.n_W,
        motion.v_WL + w_W.cross(placed.p_LE_W) - placed.distance * placed.rod.n_dot_W,
        vehicles[i].parameters.rod_length, 0.0};
    const config::InitialState& initial = vehicles[i].initial;
    if (i > 0 && initial.has_own_velocity) motion.vehicles[i].v_W = initial.v_WQ;
    const Eigen::Quaterniond q = initial.q_WB.value_or(Eigen::Quaterniond::Identity());
    motion.turns[i] = {{q.w(), q.x(), q.y(), q.z()}, initial.w_WB_B.value_or(Vector3d::Zero())};
  }
  return start;
}

}  // namespace sls::sim::cables
