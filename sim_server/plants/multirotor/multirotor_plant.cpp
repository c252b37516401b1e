#include "sim_server/plants/multirotor/multirotor_plant.hpp"
#include "sim_server/plants/air/air.hpp"

#include <Simbody.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

#include "sim_server/plants/multirotor/keys.hpp"
#include "sim_server/plants/multirotor/multirotor_dynamics.hpp"
#include "sim_server/plants/multirotor/rotor_drive.hpp"
#include "sim_server/plants/rod_frame.hpp"

namespace sls::sim {
namespace {

using Eigen::Vector3d;

/// Coordinates and speeds in Simbody's order. Body: quaternion and position; angular velocity and
/// velocity, both in W. Pendulum, relative to the body: quaternion; two or three speeds.
constexpr int kCoordinates = 11, kMostSpeeds = 9;
struct Motion {
  Eigen::Matrix<double, kCoordinates, 1> q;
  Eigen::Matrix<double, kMostSpeeds, 1> u;  ///< a speed that the joint lacks is 0
};

Motion add(const Motion& motion, double h, const Motion& rate) {
  return {motion.q + h * rate.q, motion.u + h * rate.u};
}

SimTK::Vec3 to_simtk(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Vector3d to_eigen(const SimTK::Vec3& v) { return {v[0], v[1], v[2]}; }

SimTK::Rotation to_simtk(const Eigen::Quaterniond& q) {
  return SimTK::Rotation(SimTK::Quaternion(q.w(), q.x(), q.y(), q.z()));
}

/// Mass properties about the body's origin.
SimTK::MassProperties make_mass_properties(const Airframe& airframe) {
  const Eigen::Matrix3d& J = airframe.inertia_C_B;
  const SimTK::Inertia central(J(0, 0), J(1, 1), J(2, 2), J(0, 1), J(0, 2), J(1, 2));
  const SimTK::Vec3 centre = to_simtk(airframe.p_BC);
  return {airframe.mass, centre, central.shiftFromMassCenter(centre, airframe.mass)};
}

/// Mass properties of rod and load about the joint; z along the rod.
SimTK::MassProperties make_pendulum_properties(const MultirotorKeys& keys,
                                               const model::SlungLoadParameters& vehicle) {
  const SimTK::Vec3 p_JL(0, 0, vehicle.rod_length);
  const SimTK::Inertia point = SimTK::Inertia::pointMassAt(p_JL, vehicle.load_mass);
  if (keys.pendulum == Pendulum::kIdeal) return {vehicle.load_mass, p_JL, point};
  const RodKeys& rod = *keys.rod;
  const SimTK::Vec3 p_JR(0, 0, rod.centre);
  const double mass = vehicle.load_mass + rod.mass;
  const SimTK::Inertia inertia = point + SimTK::Inertia(to_simtk(*keys.load_inertia)) +
                                 SimTK::Inertia::pointMassAt(p_JR, rod.mass) +
                                 SimTK::Inertia(to_simtk(rod.inertia));
  return {mass, (vehicle.load_mass * p_JL + rod.mass * p_JR) / mass, inertia};
}

SimTK::MobilizedBody add_pendulum(SimTK::MobilizedBody& body, const MultirotorKeys& keys,
                                  const model::SlungLoadParameters& vehicle) {
  const SimTK::Transform joint(to_simtk(keys.attachment));
  const SimTK::Body::Rigid links(make_pendulum_properties(keys, vehicle));
  // A point load has no inertia about the rod, which makes the mass matrix of a Ball singular.
  if (keys.pendulum == Pendulum::kIdeal)
    return SimTK::MobilizedBody::LineOrientation(body, joint, links, SimTK::Transform());
  return SimTK::MobilizedBody::Ball(body, joint, links, SimTK::Transform());
}

void check_finite(const Motion& motion, std::int64_t step) {
  if (!motion.q.segment<3>(4).allFinite()) throw_not_finite("quadrotor position", step);
  if (!motion.q.head<4>().allFinite()) throw_not_finite("attitude", step);
  if (!motion.q.tail<4>().allFinite()) throw_not_finite("rod direction", step);
  if (!motion.u.segment<3>(3).allFinite()) throw_not_finite("quadrotor velocity", step);
  if (!motion.u.head<3>().allFinite()) throw_not_finite("body rates", step);
  if (!motion.u.allFinite()) throw_not_finite("rod angular velocity", step);
}

/// The values that a step changes.
struct StepValues {
  std::int64_t steps = 0;
  RotorDrive::State rotors;
  Motion motion;
};

}  // namespace

/// The multibody system at one motion. README.md, "Integration", lists Simbody's part.
struct MultirotorPlant::Multibody {
  explicit Multibody(const PlantSetup& setup)
      : keys(setup.plant.own.get<MultirotorKeys>()),
        config(setup.plant),
        air(setup.plant),
        quad_wind_W(setup.plant.air.v_wind_W),
        load_wind_W(setup.plant.air.v_wind_W),
        vehicle(setup.vehicles[0].parameters),
        drive(keys, setup, 0),
        step_s(1e-9 * static_cast<double>(config.step_ns)),
        is_ideal(keys.pendulum == Pendulum::kIdeal),
        body(matter.Ground(), SimTK::Transform(),
             SimTK::Body::Rigid(make_mass_properties(drive.airframe())), SimTK::Transform()),
        pendulum(add_pendulum(body, keys, vehicle)),
        starting(drive.size()),
        middle(drive.size()),
        ending(drive.size()) {
    system.realizeTopology();
    state = system.getDefaultState();
    system.realize(state, SimTK::Stage::Instance);
    speeds = state.getNU();
    pendulum_mass = pendulum.getBodyMassProperties(state).getMass();
    dynamics.emplace(body.getBodyMassProperties(state), to_simtk(keys.attachment),
                     pendulum.getBodyMassProperties(state),
                     is_ideal ? PendulumBody::kPoint : PendulumBody::kRigid, vehicle.gravity);
    place(setup.vehicles[0].initial);
    drive.start((vehicle.quad_mass + pendulum_mass) * vehicle.gravity);
    held = measure(0);
  }

  void place(const config::InitialState& initial) {
    const model::RodDirection rod = model::to_direction(initial.rod);
    const SimTK::Rotation R_WB = to_simtk(initial.q_WB.value_or(Eigen::Quaterniond::Identity()));
    const SimTK::Vec3 w_WB_W = R_WB * to_simtk(initial.w_WB_B.value_or(Vector3d::Zero()));
    const SimTK::Vec3 p_BA_W = R_WB * to_simtk(keys.attachment);
    SimTK::Vec3 p_WQ = to_simtk(initial.position);
    if (initial.placed == config::Body::kLoad)
      p_WQ -= p_BA_W + vehicle.rod_length * to_simtk(rod.n_W);
    body.setQToFitTransform(state, SimTK::Transform(R_WB, p_WQ));
    body.setUToFitVelocity(state, SimTK::SpatialVec(w_WB_W, to_simtk(initial.v_WQ)));
    // The joint's coordinates are those of the rod relative to the body.
    pendulum.setQToFitRotation(state, ~R_WB * make_rod_frame(initial.rod));
    pendulum.setUToFitAngularVelocity(state,
                                      ~R_WB * (to_simtk(rod.n_W.cross(rod.n_dot_W)) - w_WB_W));
    const SimTK::Vector &q = state.getQ(), &u = state.getU();
    for (int i = 0; i < kCoordinates; ++i) motion.q[i] = q[i];
    motion.u.setZero();
    for (int i = 0; i < speeds; ++i) motion.u[i] = u[i];
    realize_positions(motion);
    realize_velocities(motion);
  }

  void realize_positions(const Motion& at) {
    std::copy_n(at.q.data(), kCoordinates, &state.updQ()[0]);
    matter.realizePositionKinematics(state);
  }

  void realize_velocities(const Motion& at) {
    std::copy_n(at.u.data(), speeds, &state.updU()[0]);
    matter.realizeVelocityKinematics(state);
  }

  model::Attitude attitude() const {
    // The first four coordinates are a unit quaternion.
    const Eigen::Quaterniond q_WB(motion.q[0], motion.q[1], motion.q[2], motion.q[3]);
    return {q_WB, q_WB.conjugate() * Vector3d(motion.u.head<3>())};
  }

  // --- dynamics ----------------------------------------------------------------------------------

  /// Loads of the rotors on the body: README.md, eqs. (3) to (5).
  RotorLoads calc_rotor_loads(const Motion& at, const RotorSpeeds& turning) const {
    const SimTK::Rotation& R_WB = body.getBodyRotation(state);
    const SimTK::Vec3 v_WQ = SimTK::Vec3::getAs(at.u.data() + 3);
    const Vector3d v_B = to_eigen(~R_WB * (v_WQ - to_simtk(quad_wind_W)));
    const Vector3d w_B = to_eigen(~R_WB * SimTK::Vec3::getAs(at.u.data()));
    std::optional<Vector3d> direction_B;
    if (const auto& direction_W = drive.state().output.direction_W)
      direction_B = to_eigen(~R_WB * to_simtk(*direction_W));
    return drive.calc_loads(turning.data(), v_B, w_B, direction_B);
  }

  /// Orientations and angular velocities at `at`, whose positions must be realized.
  MultirotorDynamics::Rotations find_rotations(const Motion& at) const {
    const SimTK::Rotation &R_WB = body.getBodyRotation(state),
                          &R_WP = pendulum.getBodyRotation(state);
    const SimTK::Vec3 w_WB_W = SimTK::Vec3::getAs(at.u.data());
    const SimTK::Vec3 beside = SimTK::Vec3::getAs(at.u.data() + 6);
    return {R_WB, w_WB_W, R_WP, w_WB_W + (is_ideal ? R_WP : R_WB) * beside};
  }

  /// Accelerations at `at` with its `rotations` under the rotors' loads and the disturbances.
  MultirotorDynamics::Accelerations calc_accelerations(
      const Motion& at, const MultirotorDynamics::Rotations& rotations,
      const RotorLoads& loads) const {
    const SimTK::Rotation& R_WB = rotations.R_WB;
    const SimTK::Vec3 force_W = R_WB * to_simtk(loads.force_B) + to_simtk(config.disturbance_W),
                      torque_W =
                          R_WB * to_simtk(loads.torque_B) + to_simtk(keys.disturbance_torque);
    if (!air.drags_load()) return dynamics->calc_accelerations(rotations, force_W, torque_W);
    const MultirotorDynamics::LoadForce drag{
        to_simtk(air.calc_load_drag(to_eigen(find_load(at, rotations).v_W), load_wind_W)),
        vehicle.rod_length};
    return dynamics->calc_accelerations(rotations, force_W, torque_W, &drag);
  }

  struct Place {
    SimTK::Vec3 p_W, v_W;
  };
  Place find_load(const Motion& at, const MultirotorDynamics::Rotations& rotations) const {
    const SimTK::Vec3 p_BA_W = rotations.R_WB * to_simtk(keys.attachment);
    const SimTK::Vec3 p_AL_W = rotations.R_WP * SimTK::Vec3(0, 0, vehicle.rod_length);
    return {SimTK::Vec3::getAs(at.q.data() + 4) + p_BA_W + p_AL_W,
            SimTK::Vec3::getAs(at.u.data() + 3) + rotations.w_WB_W % p_BA_W +
                rotations.w_WP_W % p_AL_W};
  }

  /// The wind over the step after `steps`.
  void hold_wind() {
    const double start = static_cast<double>(steps) * step_s;
    const Place load = find_load(motion, find_rotations(motion));
    quad_wind_W = air.calc_held_wind(start, step_s, motion.q.segment<3>(4), motion.u.segment<3>(3));
    load_wind_W = air.calc_held_wind(start, step_s, to_eigen(load.p_W), to_eigen(load.v_W));
  }

  /// Rate of change of `at`, whose positions must be realized.
  Motion calc_rate(const Motion& at, const RotorSpeeds& turning) const {
    const MultirotorDynamics::Rotations rotations = find_rotations(at);
    const auto& [R_WB, w_WB_W, R_WP, w_WP_W] = rotations;
    const auto accelerations = calc_accelerations(at, rotations, calc_rotor_loads(at, turning));
    // Eq. (13): the pendulum's speeds are relative to the body; of `ideal` in P, of `rigid` in B.
    const SimTK::Vec3 beside_W = accelerations.b_WP_W - accelerations.b_WB_W;
    SimTK::Vec3 beside =
        is_ideal ? ~R_WP * (beside_W + w_WP_W % w_WB_W) : ~R_WB * (beside_W - w_WB_W % w_WP_W);
    if (is_ideal) beside[2] = 0.0;  // the joint has no such speed
    const SimTK::Vec4 body_quaternion_rate =
        SimTK::Rotation::convertAngVelToQuaternionDot(SimTK::Vec4::getAs(at.q.data()), w_WB_W);
    const SimTK::Vec4 pendulum_quaternion_rate = SimTK::Rotation::convertAngVelToQuaternionDot(
        SimTK::Vec4::getAs(at.q.data() + 7), ~R_WB * (w_WP_W - w_WB_W));
    Motion rate;
    for (int i = 0; i < 4; ++i) rate.q[i] = body_quaternion_rate[i];
    for (int i = 0; i < 3; ++i) rate.q[4 + i] = at.u[3 + i];
    for (int i = 0; i < 4; ++i) rate.q[7 + i] = pendulum_quaternion_rate[i];
    for (int i = 0; i < 3; ++i) rate.u[i] = accelerations.b_WB_W[i];
    for (int i = 0; i < 3; ++i) rate.u[3 + i] = accelerations.a_WQ[i];
    for (int i = 0; i < 3; ++i) rate.u[6 + i] = beside[i];
    return rate;
  }

  /// One step of the classical Runge-Kutta method of fourth order; the rotor speeds are exact.
  void fly_step(std::int64_t step) {
    const double h = step_s;
    const Eigen::VectorXd& speeds_now = drive.state().speeds;
    for (std::size_t i = 0; i < drive.size(); ++i) {
      const RotorLag::Stages stages =
          drive.find_stages(i, speeds_now[static_cast<Eigen::Index>(i)]);
      starting[i] = stages.start;
      middle[i] = stages.middle;
      ending[i] = stages.end;
    }
    const auto calc_rate_at = [&](const Motion& there, const RotorSpeeds& turning) {
      check_finite(there, step);
      realize_positions(there);
      return calc_rate(there, turning);
    };
    const Motion k1 = calc_rate(motion, starting);
    const Motion k2 = calc_rate_at(add(motion, h / 2, k1), middle);
    const Motion k3 = calc_rate_at(add(motion, h / 2, k2), middle);
    const Motion k4 = calc_rate_at(add(motion, h, k3), ending);
    Motion next = add(motion, h / 6, add(add(add(k1, 2, k2), 2, k3), 1, k4));
    next.q.head<4>().normalize();
    next.q.tail<4>().normalize();
    check_finite(next, step);
    motion = next;
    for (std::size_t i = 0; i < drive.size(); ++i) drive.set_speed(i, ending[i].speed);
    realize_positions(motion);
  }

  /// If one of the steps throws, nothing changes but the autopilot's memory and the remarks.
  void advance(const Vector3d& f_Q_W, std::int64_t count) {
    check_finite(f_Q_W, steps, "force_x_n", "force_y_n", "force_z_n");
    before = {steps, drive.state(), motion};
    try {
      for (std::int64_t i = 0; i < count; ++i) {
        drive.step(f_Q_W, motion.u.segment<3>(3), attitude(), steps);
        if (air.varies()) hold_wind();
        fly_step(steps + 1);
        ++steps;
      }
      realize_velocities(motion);
      held = measure(steps);
    } catch (...) {
      steps = before.steps;
      drive.set_state(before.rotors);
      motion = before.motion;
      realize_positions(motion);
      throw;
    }
  }

  // --- measurement -------------------------------------------------------------------------------

  model::Measurement measure(std::int64_t step) {
    const SimTK::Vec3 p_PL(0, 0, vehicle.rod_length);
    SimTK::Vec3 p_WA, v_WA, p_WL, v_WL;
    body.findStationLocationAndVelocityInGround(state, to_simtk(keys.attachment), p_WA, v_WA);
    pendulum.findStationLocationAndVelocityInGround(state, p_PL, p_WL, v_WL);
    model::Measurement result;
    result.p_WQ = to_eigen(body.getBodyOriginLocation(state));
    result.v_WQ = to_eigen(body.getBodyOriginVelocity(state));
    result.p_WL = to_eigen(p_WL);
    result.v_WL = to_eigen(v_WL);
    // The rod begins at the attachment, which need not be the body's origin.
    result.rod = model::make_state(to_eigen(p_WA), to_eigen(v_WA), result.p_WL, result.v_WL).rod;
    result.attitude = attitude();
    sim::check_finite(result, step);
    result.signals = calc_signals(step);
    air.add_signals(static_cast<double>(step) * step_s, result);
    return result;
  }

  model::Numbers calc_signals(std::int64_t step) {
    for (std::size_t i = 0; i < drive.size(); ++i) {
      const double speed = drive.state().speeds[static_cast<Eigen::Index>(i)];
      starting[i] = {speed, speed * speed};
    }
    const RotorLoads loads = calc_rotor_loads(motion, starting);
    const double tension = calc_accelerations(motion, find_rotations(motion), loads).tension;

    model::Numbers signals = drive.calc_signals(loads.thrust, step);
    signals.conservativeResize(signals.size() + 1);
    signals[signals.size() - 1] = tension;
    return signals;
  }

  const MultirotorKeys keys;
  const config::Plant config;
  const Air air;
  Vector3d quad_wind_W, load_wind_W;  ///< held over a step, m/s
  const model::SlungLoadParameters vehicle;
  RotorDrive drive;
  const double step_s;
  const bool is_ideal;
  std::int64_t steps = 0;
  Motion motion;

  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter{system};
  SimTK::MobilizedBody::Free body;
  SimTK::MobilizedBody pendulum;
  SimTK::State state;  ///< stays at Stage::Instance, with the positions of `motion` realized
  int speeds = 0;      ///< number of speeds of the tree
  double pendulum_mass = 0.0;

  std::optional<MultirotorDynamics> dynamics;

  // Members, to avoid an allocation in every step.
  RotorSpeeds starting, middle, ending;  // at the stages of a step
  StepValues before;                     // an advance

  model::Measurement held;
};

MultirotorPlant::MultirotorPlant(const PlantSetup& setup)
    : multibody_(std::make_unique<Multibody>(setup)) {}

MultirotorPlant::~MultirotorPlant() = default;

void MultirotorPlant::advance(const std::vector<Vector3d>& f_Q_W, std::int64_t steps) {
  multibody_->advance(f_Q_W[0], steps);
}

const model::Measurement& MultirotorPlant::measurement(std::size_t) const {
  return multibody_->held;
}

std::vector<Signal> MultirotorPlant::signals() const {
  std::vector<Signal> signals = multibody_->drive.list_signals();
  signals.push_back({"rod_tension_n", "N"});
  multibody_->air.list_signals(signals);
  return signals;
}

std::vector<std::string> MultirotorPlant::take_remarks(std::size_t) {
  return multibody_->drive.take_remarks();
}

PlantType multirotor_type() {
  return {Moves::kOneVehicle, [](const PlantSetup& setup) -> std::unique_ptr<Plant> {
            return std::make_unique<MultirotorPlant>(setup);
          }};
}

}  // namespace sls::sim
