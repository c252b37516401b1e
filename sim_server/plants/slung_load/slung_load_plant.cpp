#include "sim_server/plants/slung_load/slung_load_plant.hpp"

#include <Simbody.h>

#include <Eigen/Geometry>
#include <cstdint>

#include "common/model/forces.hpp"
#include "sim_server/plants/air/air.hpp"
#include "sim_server/plants/rod_frame.hpp"
#include "sim_server/plants/slung_load/keys.hpp"
#include "sim_server/plants/slung_load/pendulum_dynamics.hpp"
#include "sim_server/plants/slung_load/rigid_links.hpp"

namespace sls::sim {
namespace {

/// Simbody's generalised coordinates and speeds of one vehicle, or their rates.
struct Motion {
  SimTK::Vec3 p_WQ;
  SimTK::Vec4 rod;  ///< quaternion
  SimTK::Vec3 v_WQ;
  SimTK::Vec3 rod_speeds;  ///< angular velocity of the rod: `ideal` in L, its z 0; `rigid` in W
};

Motion add(const Motion& motion, double h, const Motion& rate) {
  return {motion.p_WQ + h * rate.p_WQ, motion.rod + h * rate.rod, motion.v_WQ + h * rate.v_WQ,
          motion.rod_speeds + h * rate.rod_speeds};
}

SimTK::Vec3 to_simtk(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d to_eigen(const SimTK::Vec3& v) { return {v[0], v[1], v[2]}; }

/// Mass properties of one link about the joint; the body's z axis points down the rod.
SimTK::MassProperties make_mass_properties(const RigidLink& link) {
  const SimTK::Vec3 p_JC(0, 0, link.distance);
  const SimTK::Inertia central(link.inertia_xx, link.inertia_yy, link.inertia_zz);
  return {link.mass, p_JC, central.shiftFromMassCenter(p_JC, link.mass)};
}

/// Mass properties of two links welded together, about the joint.
SimTK::MassProperties weld(const SimTK::MassProperties& a, const SimTK::MassProperties& b) {
  const double mass = a.getMass() + b.getMass();
  const SimTK::Vec3 p_JC =
      (a.getMass() * a.getMassCenter() + b.getMass() * b.getMassCenter()) / mass;
  return {mass, p_JC, a.calcInertia() + b.calcInertia()};
}

/// Masses and length of the plant: the vehicle's, or for `rigid` those of the links.
model::SlungLoadParameters calc_flown_vehicle(const model::SlungLoadParameters& vehicle,
                                              Pendulum pendulum) {
  if (pendulum == Pendulum::kIdeal) return vehicle;
  check_rigid_vehicle(vehicle);
  model::SlungLoadParameters flown = vehicle;
  flown.quad_mass = kRigidBaseMass;
  flown.load_mass = kRigidRod.mass + kRigidLoad.mass;
  flown.rod_length = kRigidLoad.distance;
  return flown;
}

SimTK::MobilizedBody add_quadrotor(SimTK::SimbodyMatterSubsystem& matter, double mass) {
  const SimTK::MassProperties point(mass, SimTK::Vec3(0), SimTK::Inertia(0));
  return SimTK::MobilizedBody::Translation(matter.Ground(), SimTK::Body::Rigid(point));
}

SimTK::MobilizedBody add_pendulum(SimTK::MobilizedBody& quadrotor, Pendulum pendulum,
                                  const model::SlungLoadParameters& vehicle) {
  if (pendulum == Pendulum::kRigid) {
    const SimTK::MassProperties links =
        weld(make_mass_properties(kRigidRod), make_mass_properties(kRigidLoad));
    return SimTK::MobilizedBody::Ball(quadrotor, SimTK::Body::Rigid(links));
  }
  // A point load has no inertia about the rod, which makes the mass matrix of a Ball singular.
  const SimTK::Vec3 p_QL(0, 0, vehicle.rod_length);
  const SimTK::MassProperties point(vehicle.load_mass, p_QL,
                                    SimTK::Inertia::pointMassAt(p_QL, vehicle.load_mass));
  return SimTK::MobilizedBody::LineOrientation(quadrotor, SimTK::Body::Rigid(point));
}

void check_finite(const Motion& motion, std::int64_t step) {
  if (!motion.p_WQ.isFinite()) throw_not_finite("quadrotor position", step);
  if (!motion.rod.isFinite()) throw_not_finite("rod direction", step);
  if (!motion.v_WQ.isFinite()) throw_not_finite("quadrotor velocity", step);
  if (!motion.rod_speeds.isFinite()) throw_not_finite("rod angular velocity", step);
}

}  // namespace

/// The multibody system at one motion. README.md, "Integration", lists Simbody's part and gives
/// the reason. L is the pendulum's frame.
struct SlungLoadPlant::Multibody {
  Multibody(const model::SlungLoadParameters& vehicle, const config::Plant& plant)
      : config(plant),
        air(plant),
        quad_air(plant.air),
        load_wind_W(plant.air.v_wind_W),
        step_s(1e-9 * static_cast<double>(plant.step_ns)),
        has_speeds_in_L(plant.own.get<SlungLoadKeys>().pendulum == Pendulum::kIdeal),
        matter(system),
        quadrotor(add_quadrotor(matter, vehicle.quad_mass)),
        pendulum(add_pendulum(quadrotor, plant.own.get<SlungLoadKeys>().pendulum, vehicle)),
        state(make_state(system)),
        dynamics(quadrotor.getBodyMassProperties(state), pendulum.getBodyMassProperties(state),
                 vehicle.gravity),
        p_QL_L(0, 0, vehicle.rod_length) {
    place(plant.initial, vehicle.rod_length);
    held = measure(0);
  }

  static SimTK::State make_state(SimTK::MultibodySystem& system) {
    system.realizeTopology();
    SimTK::State state = system.getDefaultState();
    system.realize(state, SimTK::Stage::Instance);
    return state;
  }

  void place(const config::InitialState& initial, double rod_length) {
    const model::RodDirection rod = model::to_direction(initial.rod);
    const Eigen::Vector3d p_WQ = initial.placed == config::Body::kQuadrotor
                                     ? initial.position
                                     : initial.position - rod_length * rod.n_W;
    quadrotor.setQToFitTranslation(state, to_simtk(p_WQ));
    quadrotor.setUToFitLinearVelocity(state, to_simtk(initial.v_WQ));
    pendulum.setQToFitRotation(state, make_rod_frame(initial.rod));
    pendulum.setUToFitAngularVelocity(state, to_simtk(rod.n_W.cross(rod.n_dot_W)));  // no spin
    motion.p_WQ = SimTK::Vec3::getAs(&state.getQ()[0]);
    motion.rod = SimTK::Vec4::getAs(&state.getQ()[3]);
    motion.v_WQ = SimTK::Vec3::getAs(&state.getU()[0]);
    motion.rod_speeds = SimTK::Vec3(0);
    for (int i = 3; i < state.getNU(); ++i) motion.rod_speeds[i - 3] = state.getU()[i];
    realize_positions(motion);
    realize_velocities(motion);
  }

  void realize_positions(const Motion& at) {
    SimTK::Vector& q = state.updQ();
    SimTK::Vec3::updAs(&q[0]) = at.p_WQ;
    SimTK::Vec4::updAs(&q[3]) = at.rod;
    matter.realizePositionKinematics(state);
  }

  void realize_velocities(const Motion& at) {
    SimTK::Vector& u = state.updU();
    SimTK::Vec3::updAs(&u[0]) = at.v_WQ;
    for (int i = 3; i < u.size(); ++i) u[i] = at.rod_speeds[i - 3];
    matter.realizeVelocityKinematics(state);
  }

  /// README.md, eqs. (1) to (4). The positions of `at` must be realized.
  Motion calc_rate(const Motion& at, const Eigen::Vector3d& f_Q_W) const {
    const SimTK::Rotation& R_WL = pendulum.getBodyRotation(state);
    const SimTK::Vec3 w_L = has_speeds_in_L ? at.rod_speeds : ~R_WL * at.rod_speeds;
    const SimTK::Vec3 w_W = has_speeds_in_L ? R_WL * at.rod_speeds : at.rod_speeds;

    Eigen::Vector3d force = f_Q_W + config.disturbance_W;
    if (quad_air.rotor_drag != 0.0)
      force += model::calc_rotor_drag(f_Q_W, to_eigen(at.v_WQ), quad_air);
    const auto [a_WQ, b_L] = air.drags_load()
                                 ? dynamics.calc_accelerations(
                                       R_WL, w_L, to_simtk(force),
                                       to_simtk(air.calc_load_drag(
                                           to_eigen(at.v_WQ + w_W % (R_WL * p_QL_L)), load_wind_W)),
                                       p_QL_L)
                                 : dynamics.calc_accelerations(R_WL, w_L, to_simtk(force));

    return {at.v_WQ, SimTK::Rotation::convertAngVelToQuaternionDot(at.rod, w_W), a_WQ,
            has_speeds_in_L ? b_L : R_WL * b_L};
  }

  /// Classical Runge-Kutta step of fourth order from `start`, whose positions must be realized. On
  /// return the positions of the result are realized.
  Motion calc_next(const Motion& start, const Eigen::Vector3d& f_Q_W, std::int64_t step) {
    const double h = step_s;
    const auto calc_rate_at = [&](const Motion& there) {
      check_finite(there, step);
      realize_positions(there);
      return calc_rate(there, f_Q_W);
    };
    if (air.varies()) hold_wind(start, step - 1);
    const Motion k1 = calc_rate(start, f_Q_W);
    const Motion k2 = calc_rate_at(add(start, h / 2, k1));
    const Motion k3 = calc_rate_at(add(start, h / 2, k2));
    const Motion k4 = calc_rate_at(add(start, h, k3));
    Motion next = add(start, h / 6, add(add(add(k1, 2, k2), 2, k3), 1, k4));
    next.rod = next.rod.normalize();
    check_finite(next, step);
    realize_positions(next);
    return next;
  }

  /// The wind over the step after `step`, whose motion is `at`.
  void hold_wind(const Motion& at, std::int64_t step) {
    const double start = static_cast<double>(step) * step_s;
    const SimTK::Rotation& R_WL = pendulum.getBodyRotation(state);
    const SimTK::Vec3 w_W = has_speeds_in_L ? R_WL * at.rod_speeds : at.rod_speeds;
    const SimTK::Vec3 p_QL_W = R_WL * p_QL_L;
    quad_air.v_wind_W = air.calc_held_wind(start, step_s, to_eigen(at.p_WQ), to_eigen(at.v_WQ));
    load_wind_W = air.calc_held_wind(start, step_s, to_eigen(at.p_WQ + p_QL_W),
                                     to_eigen(at.v_WQ + w_W % p_QL_W));
  }

  /// If one of the steps throws, nothing changes.
  void advance(const Eigen::Vector3d& f_Q_W, std::int64_t count) {
    check_finite(f_Q_W, steps, "force_x_n", "force_y_n", "force_z_n");
    try {
      Motion next = motion;
      for (std::int64_t i = 1; i <= count; ++i) next = calc_next(next, f_Q_W, steps + i);
      realize_velocities(next);
      held = measure(steps + count);
      motion = next;
    } catch (...) {
      realize_positions(motion);
      throw;
    }
    steps += count;
  }

  model::Measurement measure(std::int64_t step) const {
    SimTK::Vec3 p_WL, v_WL;
    pendulum.findStationLocationAndVelocityInGround(state, p_QL_L, p_WL, v_WL);
    model::Measurement result(model::make_state(to_eigen(quadrotor.getBodyOriginLocation(state)),
                                                to_eigen(quadrotor.getBodyOriginVelocity(state)),
                                                to_eigen(p_WL), to_eigen(v_WL)));
    sim::check_finite(result, step);
    air.add_signals(static_cast<double>(step) * step_s, result);
    return result;
  }

  const config::Plant config;
  const Air air;
  model::Aerodynamics quad_air;  ///< with the wind held over a step
  Eigen::Vector3d load_wind_W;   ///< held over a step, m/s
  const double step_s;
  const bool has_speeds_in_L;
  std::int64_t steps = 0;
  Motion motion;  ///< after `steps` steps

  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter;
  SimTK::MobilizedBody quadrotor;
  SimTK::MobilizedBody pendulum;
  SimTK::State state;  ///< stays at Stage::Instance
  const PendulumDynamics dynamics;
  const SimTK::Vec3 p_QL_L;  ///< m

  model::Measurement held;  ///< measurement of `state`
};

SlungLoadPlant::SlungLoadPlant(const model::SlungLoadParameters& vehicle,
                               const config::Plant& plant)
    : multibody_(std::make_unique<Multibody>(
          calc_flown_vehicle(vehicle, plant.own.get<SlungLoadKeys>().pendulum), plant)) {}

SlungLoadPlant::~SlungLoadPlant() = default;

void SlungLoadPlant::step(const Eigen::Vector3d& f_Q_W) { multibody_->advance(f_Q_W, 1); }

const model::SlungLoadState& SlungLoadPlant::state() const { return multibody_->held; }

void SlungLoadPlant::advance(const std::vector<Eigen::Vector3d>& f_Q_W, std::int64_t steps) {
  multibody_->advance(f_Q_W[0], steps);
}

const model::Measurement& SlungLoadPlant::measurement(std::size_t) const {
  return multibody_->held;
}

std::vector<Signal> SlungLoadPlant::signals() const {
  std::vector<Signal> signals;
  multibody_->air.list_signals(signals);
  return signals;
}

PlantType slung_load_type() {
  return {Moves::kOneVehicle, [](const PlantSetup& setup) -> std::unique_ptr<Plant> {
            config::Plant plant = setup.plant;
            plant.initial = setup.vehicles[0].initial;
            return std::make_unique<SlungLoadPlant>(setup.vehicles[0].parameters, plant);
          }};
}

}  // namespace sls::sim
