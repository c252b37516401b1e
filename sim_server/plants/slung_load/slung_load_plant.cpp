#include "sim_server/plants/slung_load/slung_load_plant.hpp"

#include <Simbody.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "common/model/forces.hpp"
#include "sim_server/plants/slung_load/keys.hpp"
#include "sim_server/plants/slung_load/rigid_links.hpp"

namespace sls::sim {
namespace {

/// Simbody's generalised coordinates (quadrotor position, rod quaternion) and speeds (quadrotor
/// velocity, rod angular velocity: two numbers for `ideal`, three for `rigid`), or their rates.
struct Motion {
  Eigen::Matrix<double, 7, 1> q;
  Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1> u;
};

Motion add(const Motion& motion, const Motion& rate, double h) {
  return {motion.q + h * rate.q, motion.u + h * rate.u};
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

/// Masses and length that fly: the vehicle's, or the links' for `rigid`.
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
  if (!motion.q.head<3>().allFinite()) throw_not_finite("quadrotor position", step);
  if (!motion.q.tail<4>().allFinite()) throw_not_finite("rod direction", step);
  if (!motion.u.head<3>().allFinite()) throw_not_finite("quadrotor velocity", step);
  if (!motion.u.allFinite()) throw_not_finite("rod angular velocity", step);
}

}  // namespace

/// The multibody system at one state. README.md, "Integration", says why forces and accelerations
/// go through the operators of the matter subsystem and not through force elements and `realize`.
struct SlungLoadPlant::Multibody {
  Multibody(const model::SlungLoadParameters& vehicle, const config::Plant& plant)
      : config(plant),
        step_s(1e-9 * static_cast<double>(plant.step_ns)),
        matter(system),
        quadrotor(add_quadrotor(matter, vehicle.quad_mass)),
        pendulum(add_pendulum(quadrotor, plant.own.get<SlungLoadKeys>().pendulum, vehicle)),
        p_QL(0, 0, vehicle.rod_length) {
    system.realizeTopology();
    state = system.getDefaultState();
    system.realize(state, SimTK::Stage::Instance);
    const SimTK::MassProperties& links = pendulum.getBodyMassProperties(state);
    pendulum_centre = links.getMassCenter();
    weight_quadrotor = SimTK::Vec3(0, 0, vehicle.quad_mass * vehicle.gravity);
    weight_pendulum = SimTK::Vec3(0, 0, links.getMass() * vehicle.gravity);
    body_forces.resize(matter.getNumBodies());
    body_forces.setToZero();
    generalized_forces.resize(matter.getNumMobilities());
    accelerations.resize(matter.getNumMobilities());
    place(plant.initial, vehicle.rod_length);
    held = calc_finite_state(0);
  }

  void place(const config::InitialState& initial, double rod_length) {
    const model::RodDirection rod = model::to_direction(initial.rod);
    const Eigen::Vector3d p_WQ = initial.placed == config::Body::kQuadrotor
                                     ? initial.position
                                     : initial.position - rod_length * rod.n_W;
    // Its z axis is the rod: common/model/README.md, eq. (1).
    const SimTK::Rotation R_WL(SimTK::BodyRotationSequence, initial.rod.alpha, SimTK::XAxis,
                               initial.rod.beta, SimTK::YAxis);
    quadrotor.setQToFitTranslation(state, to_simtk(p_WQ));
    quadrotor.setUToFitLinearVelocity(state, to_simtk(initial.v_WQ));
    pendulum.setQToFitRotation(state, R_WL);
    pendulum.setUToFitAngularVelocity(state, to_simtk(rod.n_W.cross(rod.n_dot_W)));  // no spin
    realize_kinematics();
  }

  Motion motion() const {
    const SimTK::Vector &q = state.getQ(), &u = state.getU();
    return {Eigen::Map<const Eigen::Matrix<double, 7, 1>>(q.getContiguousScalarData()),
            Eigen::Map<const Eigen::VectorXd>(u.getContiguousScalarData(), u.size())};
  }

  void set_motion(const Motion& motion) {
    SimTK::Vector &q = state.updQ(), &u = state.updU();
    Eigen::Map<Eigen::VectorXd>(q.updContiguousScalarData(), q.size()) = motion.q;
    Eigen::Map<Eigen::VectorXd>(u.updContiguousScalarData(), u.size()) = motion.u;
    realize_kinematics();
  }

  void realize_kinematics() const {
    matter.realizePositionKinematics(state);
    matter.realizeVelocityKinematics(state);
  }

  /// Total force on the quadrotor besides gravity and rod, at the velocity of this stage.
  Eigen::Vector3d calc_force(const Eigen::Vector3d& f_Q_W) const {
    const Eigen::Vector3d v_WQ =
        to_eigen(SimTK::Vec3::getAs(state.getU().getContiguousScalarData()));
    return f_Q_W + model::calc_rotor_drag(f_Q_W, v_WQ, config.air) + config.disturbance_W;
  }

  /// README.md, eq. (2): u̇ = M⁻¹ Jᵀ (applied − centrifugal), and q̇ from u.
  Motion calc_rate(const Eigen::Vector3d& f_Q_W) {
    const SimTK::MobilizedBodyIndex quadrotor_index = quadrotor.getMobilizedBodyIndex();
    const SimTK::MobilizedBodyIndex pendulum_index = pendulum.getMobilizedBodyIndex();
    body_forces[quadrotor_index][1] = weight_quadrotor + to_simtk(calc_force(f_Q_W));
    body_forces[pendulum_index] = -matter.getTotalCentrifugalForces(state, pendulum_index);
    matter.addInStationForce(state, pendulum_index, pendulum_centre, weight_pendulum, body_forces);
    matter.multiplyBySystemJacobianTranspose(state, body_forces, generalized_forces);
    matter.multiplyByMInv(state, generalized_forces, accelerations);

    const Motion now = motion();
    const SimTK::Vec4 quaternion_dot = SimTK::Rotation::convertAngVelToQuaternionDot(
        SimTK::Vec4::getAs(now.q.data() + 3), pendulum.getBodyAngularVelocity(state));
    Motion rate;
    rate.q << now.u.head<3>(), quaternion_dot[0], quaternion_dot[1], quaternion_dot[2],
        quaternion_dot[3];
    rate.u = Eigen::Map<const Eigen::VectorXd>(accelerations.getContiguousScalarData(),
                                               accelerations.size());
    return rate;
  }

  /// Rate at another motion than the present one, which is lost.
  Motion calc_rate_at(const Motion& there, const Eigen::Vector3d& f_Q_W) {
    check_finite(there, steps + 1);
    set_motion(there);
    return calc_rate(f_Q_W);
  }

  /// Classical Runge-Kutta step of fourth order.
  Motion calc_next(const Motion& start, const Eigen::Vector3d& f_Q_W) {
    const double h = step_s;
    const Motion k1 = calc_rate(f_Q_W);
    const Motion k2 = calc_rate_at(add(start, k1, h / 2), f_Q_W);
    const Motion k3 = calc_rate_at(add(start, k2, h / 2), f_Q_W);
    const Motion k4 = calc_rate_at(add(start, k3, h), f_Q_W);
    Motion next;
    next.q = start.q + h / 6 * (k1.q + 2 * k2.q + 2 * k3.q + k4.q);
    next.u = start.u + h / 6 * (k1.u + 2 * k2.u + 2 * k3.u + k4.u);
    next.q.tail<4>().normalize();
    check_finite(next, steps + 1);
    return next;
  }

  /// A step that throws leaves everything as it was.
  void step(const Eigen::Vector3d& f_Q_W) {
    check_finite(f_Q_W, steps, "force_x_n", "force_y_n", "force_z_n");
    const Motion start = motion();
    try {
      set_motion(calc_next(start, f_Q_W));
      held = calc_finite_state(steps + 1);
    } catch (...) {
      set_motion(start);
      throw;
    }
    ++steps;
  }

  model::SlungLoadState calc_finite_state(std::int64_t step) const {
    SimTK::Vec3 p_WL, v_WL;
    pendulum.findStationLocationAndVelocityInGround(state, p_QL, p_WL, v_WL);
    const model::SlungLoadState result = model::make_state(
        to_eigen(quadrotor.getBodyOriginLocation(state)),
        to_eigen(quadrotor.getBodyOriginVelocity(state)), to_eigen(p_WL), to_eigen(v_WL));
    check_finite(result, step);
    return result;
  }

  const config::Plant config;
  const double step_s;
  std::int64_t steps = 0;

  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter;
  SimTK::MobilizedBody quadrotor;
  SimTK::MobilizedBody pendulum;
  SimTK::State state;  ///< stays at Stage::Instance, with the kinematics of q and u realized

  const SimTK::Vec3 p_QL;       ///< load in the pendulum's frame, m
  SimTK::Vec3 pendulum_centre;  ///< its centre of mass in its frame, m
  SimTK::Vec3 weight_quadrotor;
  SimTK::Vec3 weight_pendulum;

  // Kept from step to step to spare their allocation.
  SimTK::Vector_<SimTK::SpatialVec> body_forces;
  SimTK::Vector generalized_forces;
  SimTK::Vector accelerations;

  model::Measurement held;  ///< what `state` says
};

SlungLoadPlant::SlungLoadPlant(const model::SlungLoadParameters& vehicle,
                               const config::Plant& plant)
    : multibody_(std::make_unique<Multibody>(
          calc_flown_vehicle(vehicle, plant.own.get<SlungLoadKeys>().pendulum), plant)) {}

SlungLoadPlant::~SlungLoadPlant() = default;

void SlungLoadPlant::step(const Eigen::Vector3d& f_Q_W) { multibody_->step(f_Q_W); }

const model::SlungLoadState& SlungLoadPlant::state() const { return multibody_->held; }

void SlungLoadPlant::advance(const std::vector<Eigen::Vector3d>& f_Q_W, std::int64_t steps) {
  for (std::int64_t i = 0; i < steps; ++i) multibody_->step(f_Q_W[0]);
}

const model::Measurement& SlungLoadPlant::measurement(std::size_t) const {
  return multibody_->held;
}

PlantType slung_load_type() {
  return {Moves::kOneVehicle, [](const PlantSetup& setup) -> std::unique_ptr<Plant> {
            config::Plant plant = setup.plant;
            plant.initial = setup.vehicles[0].initial;
            return std::make_unique<SlungLoadPlant>(setup.vehicles[0].parameters, plant);
          }};
}

}  // namespace sls::sim
