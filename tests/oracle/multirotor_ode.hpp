/// A multirotor with a slung load as an ODE: an oracle for tests, derived only from Newton's and
/// Euler's equations of each body. The joint's force is an unknown of a linear system; no joint
/// coordinates are used. It shares no equation with the plant.
///
/// Frame W: x forward, y right, z down. Body B: same axes, origin Q. Body with mass m, centre of
/// mass C at c from Q, inertia J about C; joint A at a from Q; r = a − c; force f_A of the pendulum
/// on the body. All vectors here are in W:
///
///     m a_C = m g e₃ + F + d + Σ f_i + f_A
///     J ω̇   = t + Σ (τ_i + (r_i − c) × f_i) − c × (F + d) − ω × J ω + r × f_A
///     a_A   = a_C + ω̇ × r + ω × (ω × r) = a_A|0 + K f_A,     K = I/m − [r]× J⁻¹ [r]×
///
/// `kIdeal`, a point mass M at distance L below A along the unit vector n, f_A = T n:
///
///     M a_L = M g e₃ − T n,   n·(a_L − a_A) = −L |ṅ|²
///     T (1/M + n·K n) = n·(g e₃ − a_A|0) + L |ṅ|²,   n̈ = (a_L − a_A) / L
///
/// `kRigid`, a body with mass M, inertia I about its centre G, angular velocity Ω, ρ = A − G:
///
///     M a_G = M g e₃ − f_A,   I Ω̇ = −ρ × f_A − Ω × I Ω
///     a_A   = a_G + Ω̇ × ρ + Ω × (Ω × ρ) = a_A'|0 − K' f_A,   K' = I/M − [ρ]× I⁻¹ [ρ]×
///     (K + K') f_A = a_A'|0 − a_A|0
///
/// Rotor i at r_i, unit axis a_i (direction of thrust), speed w, hub velocity v relative to the
/// air, v_⊥ = v − a_i (a_i·v), in B:
///
///     T_i = k_f w² clamp(1 − |v·a_i| / v_loss, 0, 1)
///     f_i = T_i a_i − |w| k_d v_⊥,     τ_i = −s k_m T_i a_i − |w| k_r v_⊥
///     w(t) = w_s + (w_0 − w_s) exp(−t / τ),   τ = τ_up if w_s > w_0, else τ_down
///
/// s = +1: the rotor turns counter-clockwise, seen from the side to which the thrust points. Rotors
/// have no inertia: no gyroscopic torque and no torque from their acceleration.
///
///     using namespace sls::oracle::multirotor;
///     Vehicle vehicle;
///     vehicle.body = combine({base, sensor});
///     vehicle.rotors = {…};
///     vehicle.pendulum.p_QA_B << 0.0, 0.0, 0.05;
///     State state;
///     state.rotor_speeds.assign(4, 600.0);
///     state = with_rod(state, n_W, n_dot_W);
///     Inputs inputs;
///     inputs.rotor_set_points = {650.0, 640.0, 655.0, 645.0};
///     state = step(state, inputs, vehicle, 0.004, 16);            // 4 ms in 16 Runge-Kutta steps
///     calc_load(state, vehicle).p_W;
///     calc_rate(state, inputs, vehicle).tension;
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace sls::oracle::multirotor {

/// A rigid body fixed in B.
struct Body {
  double mass = 0.0;                                    ///< kg
  Eigen::Vector3d p_QC_B = Eigen::Vector3d::Zero();     ///< its centre of mass from Q, m
  Eigen::Matrix3d inertia_B = Eigen::Matrix3d::Zero();  ///< about its centre of mass, kg m²
};

/// All `bodies` welded into one: parallel axis theorem, J = Σ J_i + m_i (|r|² I − r rᵀ).
inline Body combine(const std::vector<Body>& bodies) {
  Body whole;
  for (const Body& body : bodies) {
    whole.mass += body.mass;
    whole.p_QC_B += body.mass * body.p_QC_B;
  }
  whole.p_QC_B /= whole.mass;
  for (const Body& body : bodies) {
    const Eigen::Vector3d r = body.p_QC_B - whole.p_QC_B;
    whole.inertia_B += body.inertia_B + body.mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() -
                                                     r * r.transpose());
  }
  return whole;
}

struct Rotor {
  Eigen::Vector3d p_QR_B = Eigen::Vector3d::Zero();    ///< hub from Q, m
  Eigen::Vector3d axis_B = -Eigen::Vector3d::UnitZ();  ///< unit vector along the thrust
  int spin = 1;                                        ///< +1 counter-clockwise from above, or −1
  double thrust_constant = 0.0;                        ///< k_f, N/(rad/s)²
  double torque_constant = 0.0;                        ///< k_m, torque per thrust, m
  double min_speed = 0.0, max_speed = 1e9;             ///< limits of the set-point, rad/s
  double lag_up = 0.0, lag_down = 0.0;                 ///< τ, s; 0: the speed follows at once
  std::optional<double> loss_speed;                    ///< v_loss, m/s; none: no loss
  double drag_constant = 0.0;                          ///< k_d, N s²/(m rad)
  double rolling_constant = 0.0;                       ///< k_r, N s²/rad
};

enum class PendulumModel { kNone, kIdeal, kRigid };

struct Pendulum {
  PendulumModel model = PendulumModel::kIdeal;
  Eigen::Vector3d p_QA_B = Eigen::Vector3d::Zero();  ///< joint from Q, m
  double load_mass = 0.2;                            ///< kg
  double load_distance = 1.0;                        ///< of the load's centre from the joint, m
  // kRigid only; inertias about each part's own centre, across and along the rod, kg m².
  double rod_mass = 0.0;
  double rod_distance = 0.0;  ///< of the rod's centre from the joint, m
  double rod_inertia_across = 0.0, rod_inertia_along = 0.0;
  double load_inertia_across = 0.0, load_inertia_along = 0.0;
};

/// The whole pendulum: mass, distance of its centre below the joint, inertia about the centre.
struct PendulumMass {
  double mass = 0.0, centre = 0.0, inertia_across = 0.0, inertia_along = 0.0;
};

inline PendulumMass calc_mass(const Pendulum& pendulum) {
  if (pendulum.model == PendulumModel::kNone) return {};
  if (pendulum.model == PendulumModel::kIdeal)
    return {pendulum.load_mass, pendulum.load_distance, 0.0, 0.0};
  PendulumMass whole;
  whole.mass = pendulum.rod_mass + pendulum.load_mass;
  whole.centre =
      (pendulum.rod_mass * pendulum.rod_distance + pendulum.load_mass * pendulum.load_distance) /
      whole.mass;
  const double rod = pendulum.rod_distance - whole.centre;
  const double load = pendulum.load_distance - whole.centre;
  whole.inertia_across = pendulum.rod_inertia_across + pendulum.rod_mass * rod * rod +
                         pendulum.load_inertia_across + pendulum.load_mass * load * load;
  whole.inertia_along = pendulum.rod_inertia_along + pendulum.load_inertia_along;
  return whole;
}

struct Vehicle {
  Body body;
  std::vector<Rotor> rotors;
  Pendulum pendulum;
  double gravity = 9.8;  ///< m/s²
};

/// `kIdeal` integrates n_W and n_dot_W, `kRigid` q_WP and w_WP_P. `with_rod` sets all four. After a
/// step n_W and n_dot_W are valid for both models.
struct State {
  Eigen::Vector3d p_WQ = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_WQ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();  ///< rotates B into W
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();          ///< angular velocity in B, rad/s
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();            ///< unit vector joint→load
  Eigen::Vector3d n_dot_W = Eigen::Vector3d::Zero();         ///< n_W · n_dot_W = 0
  Eigen::Quaterniond q_WP = Eigen::Quaterniond::Identity();  ///< of the pendulum, z along the rod
  Eigen::Vector3d w_WP_P = Eigen::Vector3d::Zero();          ///< in P, rad/s
  std::vector<double> rotor_speeds;                          ///< rad/s
};

/// Inputs held during a step. Without a set-point a rotor keeps its speed.
struct Inputs {
  std::vector<double> rotor_set_points;                            ///< rad/s, before clamping
  Eigen::Vector3d f_Q_W = Eigen::Vector3d::Zero();                 ///< direct force on Q, N
  Eigen::Vector3d disturbance_force_W = Eigen::Vector3d::Zero();   ///< on Q, N
  Eigen::Vector3d disturbance_torque_W = Eigen::Vector3d::Zero();  ///< N m
  Eigen::Vector3d v_wind_W = Eigen::Vector3d::Zero();              ///< m/s
};

/// Time derivative of the motion, and the joint's force.
struct Rate {
  Eigen::Vector3d v_WQ, a_WQ;
  Eigen::Vector4d q_WB_dot;  ///< (x, y, z, w), as Eigen stores them
  Eigen::Vector3d w_WB_B_dot;
  Eigen::Vector3d n_dot_W = Eigen::Vector3d::Zero(), n_ddot_W = Eigen::Vector3d::Zero();
  Eigen::Vector4d q_WP_dot = Eigen::Vector4d::Zero();
  Eigen::Vector3d w_WP_P_dot = Eigen::Vector3d::Zero();
  Eigen::Vector3d f_A_W = Eigen::Vector3d::Zero();  ///< of the pendulum on the body, N
  double tension = 0.0;                             ///< n · f_A, N, positive pulls
};

/// A place and its velocity.
struct Point {
  Eigen::Vector3d p_W, v_W;
};

/// The body's point at `p_QX_B`.
inline Point calc_body_point(const State& state, const Eigen::Vector3d& p_QX_B) {
  return {state.p_WQ + state.q_WB * p_QX_B, state.v_WQ + state.q_WB * state.w_WB_B.cross(p_QX_B)};
}

/// The pendulum's point at `distance` below the joint.
inline Point calc_rod_point(const State& state, const Vehicle& vehicle, double distance) {
  const Point joint = calc_body_point(state, vehicle.pendulum.p_QA_B);
  return {joint.p_W + distance * state.n_W, joint.v_W + distance * state.n_dot_W};
}

inline Point calc_load(const State& state, const Vehicle& vehicle) {
  return calc_rod_point(state, vehicle, vehicle.pendulum.load_distance);
}

/// `state` with the rod along `n_W`. The rod turns with `n_dot_W` (only its part perpendicular to
/// n_W counts) and, if it is rigid, with `spin` about its own axis, rad/s.
inline State with_rod(State state, const Eigen::Vector3d& n_W,
                      const Eigen::Vector3d& n_dot_W = Eigen::Vector3d::Zero(), double spin = 0.0) {
  state.n_W = n_W.normalized();
  state.n_dot_W = n_dot_W - state.n_W * state.n_W.dot(n_dot_W);
  // The turn from e₃ to n. FromTwoVectors would do the same, and take 10 s to compile.
  const Eigen::Vector3d& n = state.n_W;
  state.q_WP = n.z() > -1.0 ? Eigen::Quaterniond(1.0 + n.z(), -n.y(), n.x(), 0.0).normalized()
                            : Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0);
  state.w_WP_P =
      state.q_WP.conjugate() * (state.n_W.cross(state.n_dot_W) + spin * state.n_W).eval();
  return state;
}

// Rotors.

/// Speed of a rotor `t` seconds after it received `set_point` at the speed `start`.
inline double calc_rotor_speed(const Rotor& rotor, double start, double set_point, double t) {
  const double target = std::clamp(set_point, rotor.min_speed, rotor.max_speed);
  const double lag = target > start ? rotor.lag_up : rotor.lag_down;
  return lag > 0.0 ? target + (start - target) * std::exp(-t / lag) : target;
}

inline std::vector<double> calc_rotor_speeds(const Vehicle& vehicle, std::vector<double> speeds,
                                             const Inputs& inputs, double t) {
  for (std::size_t i = 0; i < inputs.rotor_set_points.size(); ++i)
    speeds.at(i) =
        calc_rotor_speed(vehicle.rotors.at(i), speeds.at(i), inputs.rotor_set_points[i], t);
  return speeds;
}

/// The smooth piece of a rotor's loss for the velocity along its axis: −1 against the thrust, 1
/// along it, 0 if no thrust remains.
inline int calc_loss_piece(const Rotor& rotor, double axial_velocity) {
  if (!rotor.loss_speed) return 1;
  if (std::abs(axial_velocity) >= *rotor.loss_speed) return 0;
  return axial_velocity < 0.0 ? -1 : 1;
}

/// Velocity of the hub relative to the air, in B.
inline Eigen::Vector3d calc_hub_velocity(const State& state, const Inputs& inputs,
                                         const Rotor& rotor) {
  return state.q_WB.conjugate() * (state.v_WQ - inputs.v_wind_W).eval() +
         state.w_WB_B.cross(rotor.p_QR_B);
}

/// The piece of each rotor's loss in this state.
inline std::vector<int> calc_loss_pieces(const State& state, const Inputs& inputs,
                                         const Vehicle& vehicle) {
  std::vector<int> pieces;
  for (const Rotor& rotor : vehicle.rotors)
    pieces.push_back(
        calc_loss_piece(rotor, calc_hub_velocity(state, inputs, rotor).dot(rotor.axis_B)));
  return pieces;
}

struct RotorForces {
  double thrust;             ///< N
  Eigen::Vector3d force_B;   ///< at the hub, N
  Eigen::Vector3d torque_B;  ///< N m
};

/// Forces of a rotor at `speed`, with hub velocity `v_B` relative to the air, on the given piece of
/// its loss.
inline RotorForces calc_rotor_forces(const Rotor& rotor, double speed, const Eigen::Vector3d& v_B,
                                     int piece) {
  const double axial = v_B.dot(rotor.axis_B);
  const Eigen::Vector3d across = v_B - axial * rotor.axis_B;
  double loss = 1.0;
  if (rotor.loss_speed) loss = piece == 0 ? 0.0 : 1.0 - piece * axial / *rotor.loss_speed;
  const double thrust = rotor.thrust_constant * speed * speed * loss;
  return {thrust, thrust * rotor.axis_B - std::abs(speed) * rotor.drag_constant * across,
          -rotor.spin * rotor.torque_constant * thrust * rotor.axis_B -
              std::abs(speed) * rotor.rolling_constant * across};
}

/// Forces of all rotors at the state's speeds.
inline std::vector<RotorForces> calc_rotor_forces(const State& state, const Inputs& inputs,
                                                  const Vehicle& vehicle,
                                                  const std::vector<int>& pieces) {
  std::vector<RotorForces> forces;
  for (std::size_t i = 0; i < vehicle.rotors.size(); ++i)
    forces.push_back(calc_rotor_forces(vehicle.rotors[i], state.rotor_speeds.at(i),
                                       calc_hub_velocity(state, inputs, vehicle.rotors[i]),
                                       pieces.at(i)));
  return forces;
}

inline std::vector<RotorForces> calc_rotor_forces(const State& state, const Inputs& inputs,
                                                  const Vehicle& vehicle) {
  return calc_rotor_forces(state, inputs, vehicle, calc_loss_pieces(state, inputs, vehicle));
}

// Equations of motion.

/// [v]×, the matrix of v × ….
inline Eigen::Matrix3d calc_cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// q̇ = ½ q ⊗ (0, ω), ω in the frame that q rotates.
inline Eigen::Vector4d calc_quaternion_rate(const Eigen::Quaterniond& q, const Eigen::Vector3d& w) {
  return 0.5 * (q * Eigen::Quaterniond(0.0, w.x(), w.y(), w.z())).coeffs();
}

/// Derivative of `state` with its rotor speeds, each rotor on the given piece of its loss.
inline Rate calc_rate(const State& state, const Inputs& inputs, const Vehicle& vehicle,
                      const std::vector<int>& pieces) {
  using Eigen::Matrix3d;
  using Eigen::Vector3d;
  const Vector3d gravity_W(0.0, 0.0, vehicle.gravity);
  const Matrix3d R_WB = state.q_WB.normalized().toRotationMatrix();
  const Body& body = vehicle.body;

  // Force and torque about C, without gravity and joint.
  const Vector3d on_origin_W = inputs.f_Q_W + inputs.disturbance_force_W;
  const Vector3d c_W = R_WB * body.p_QC_B;
  Vector3d force_W = on_origin_W;
  Vector3d torque_W = inputs.disturbance_torque_W - c_W.cross(on_origin_W);
  const std::vector<RotorForces> rotors = calc_rotor_forces(state, inputs, vehicle, pieces);
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    force_W += R_WB * rotors[i].force_B;
    torque_W += R_WB * (rotors[i].torque_B +
                        (vehicle.rotors[i].p_QR_B - body.p_QC_B).cross(rotors[i].force_B));
  }

  // Accelerations without the pendulum, and K: the joint's acceleration per force at the joint.
  const Vector3d w_W = R_WB * state.w_WB_B;
  const Matrix3d J_W = R_WB * body.inertia_B * R_WB.transpose();
  const Matrix3d J_inverse_W = R_WB * body.inertia_B.inverse() * R_WB.transpose();
  const Vector3d r_W = R_WB * (vehicle.pendulum.p_QA_B - body.p_QC_B);
  const Vector3d a_WC_free = gravity_W + force_W / body.mass;
  const Vector3d w_dot_free = J_inverse_W * (torque_W - w_W.cross(J_W * w_W));
  const Vector3d a_WA_free = a_WC_free + w_dot_free.cross(r_W) + w_W.cross(w_W.cross(r_W));
  const Matrix3d r_cross = calc_cross_matrix(r_W);
  const Matrix3d K = Matrix3d::Identity() / body.mass - r_cross * J_inverse_W * r_cross;

  Rate rate;
  const PendulumMass pendulum = calc_mass(vehicle.pendulum);
  if (vehicle.pendulum.model == PendulumModel::kIdeal) {
    const Vector3d& n = state.n_W;
    const double length = pendulum.centre;
    rate.tension = (n.dot(gravity_W - a_WA_free) + length * state.n_dot_W.squaredNorm()) /
                   (1.0 / pendulum.mass + n.dot(K * n));
    rate.f_A_W = rate.tension * n;
    rate.n_dot_W = state.n_dot_W;
    rate.n_ddot_W = (gravity_W - rate.f_A_W / pendulum.mass - a_WA_free - K * rate.f_A_W) / length;
  } else if (vehicle.pendulum.model == PendulumModel::kRigid) {
    const Matrix3d R_WP = state.q_WP.normalized().toRotationMatrix();
    const Vector3d inertia(pendulum.inertia_across, pendulum.inertia_across,
                           pendulum.inertia_along);
    const Matrix3d I_W = R_WP * inertia.asDiagonal() * R_WP.transpose();
    const Matrix3d I_inverse_W = R_WP * inertia.cwiseInverse().asDiagonal() * R_WP.transpose();
    const Vector3d n = R_WP.col(2), W_W = R_WP * state.w_WP_P, rho_W = -pendulum.centre * n;
    const Vector3d W_dot_free = -I_inverse_W * W_W.cross(I_W * W_W);
    const Vector3d a_WA_of_rod = gravity_W + W_dot_free.cross(rho_W) + W_W.cross(W_W.cross(rho_W));
    const Matrix3d rho_cross = calc_cross_matrix(rho_W);
    const Matrix3d K_rod =
        Matrix3d::Identity() / pendulum.mass - rho_cross * I_inverse_W * rho_cross;
    rate.f_A_W = Matrix3d(K + K_rod).inverse() * (a_WA_of_rod - a_WA_free);
    rate.tension = n.dot(rate.f_A_W);
    const Vector3d W_dot_W = W_dot_free - I_inverse_W * rho_W.cross(rate.f_A_W);
    rate.q_WP_dot = calc_quaternion_rate(state.q_WP, state.w_WP_P);
    rate.w_WP_P_dot = R_WP.transpose() * W_dot_W;
    rate.n_dot_W = W_W.cross(n);
    rate.n_ddot_W = W_dot_W.cross(n) + W_W.cross(rate.n_dot_W);
  }

  const Vector3d a_WC = a_WC_free + rate.f_A_W / body.mass;
  const Vector3d w_dot_W = w_dot_free + J_inverse_W * r_W.cross(rate.f_A_W);
  rate.v_WQ = state.v_WQ;
  rate.a_WQ = a_WC - w_dot_W.cross(c_W) - w_W.cross(w_W.cross(c_W));
  rate.q_WB_dot = calc_quaternion_rate(state.q_WB, state.w_WB_B);
  rate.w_WB_B_dot = R_WB.transpose() * w_dot_W;
  return rate;
}

/// Derivative of `state` with its rotor speeds.
inline Rate calc_rate(const State& state, const Inputs& inputs, const Vehicle& vehicle) {
  return calc_rate(state, inputs, vehicle, calc_loss_pieces(state, inputs, vehicle));
}

// Integration.

/// state + h · rate. Does not change rotor speeds and does not restore unit lengths.
inline State advance(State state, const Rate& rate, double h) {
  state.p_WQ += h * rate.v_WQ;
  state.v_WQ += h * rate.a_WQ;
  state.q_WB.coeffs() += h * rate.q_WB_dot;
  state.w_WB_B += h * rate.w_WB_B_dot;
  state.n_W += h * rate.n_dot_W;
  state.n_dot_W += h * rate.n_ddot_W;
  state.q_WP.coeffs() += h * rate.q_WP_dot;
  state.w_WP_P += h * rate.w_WP_P_dot;
  return state;
}

/// Restores unit lengths, and calculates n_W and n_dot_W of a rigid rod from its orientation.
inline State restore(State state, const Vehicle& vehicle) {
  state.q_WB.normalize();
  if (vehicle.pendulum.model == PendulumModel::kIdeal) {
    state.n_W.normalize();
    state.n_dot_W -= state.n_W * state.n_W.dot(state.n_dot_W);
  } else if (vehicle.pendulum.model == PendulumModel::kRigid) {
    state.q_WP.normalize();
    state.n_W = state.q_WP * Eigen::Vector3d::UnitZ();
    state.n_dot_W = state.q_WP * state.w_WP_P.cross(Eigen::Vector3d::UnitZ());
  }
  return state;
}

/// One classical fourth-order Runge-Kutta step of `h` seconds, each rotor on one piece of its loss;
/// `speeds_at(tau)` are the rotor speeds `tau` seconds into the step.
template <typename SpeedsAt>
State rk4_step(const State& state, const SpeedsAt& speeds_at, double h, const Inputs& inputs,
               const Vehicle& vehicle, const std::vector<int>& pieces) {
  State start = state, middle = state, end = state;
  start.rotor_speeds = speeds_at(0.0);
  middle.rotor_speeds = speeds_at(h / 2);
  end.rotor_speeds = speeds_at(h);
  const Rate k1 = calc_rate(start, inputs, vehicle, pieces);
  const Rate k2 = calc_rate(advance(middle, k1, h / 2), inputs, vehicle, pieces);
  const Rate k3 = calc_rate(advance(middle, k2, h / 2), inputs, vehicle, pieces);
  const Rate k4 = calc_rate(advance(end, k3, h), inputs, vehicle, pieces);
  State next = advance(advance(end, k1, h / 6), k4, h / 6);
  next = advance(advance(next, k2, h / 3), k3, h / 3);
  return restore(next, vehicle);
}

/// `state` after `duration` seconds with `inputs` held, by `substeps` Runge-Kutta steps. Rotor
/// speeds are exact at every stage. The slope of a rotor's loss jumps where the hub's axial
/// velocity changes sign; the step is split there, because the jump would reduce the order of
/// convergence.
///
/// With predefined set-points nothing controls the attitude and differences grow: 32 s with steps
/// of 0.125 and 0.0625 ms differed by 1e-3 to 1e-2 m. With set-points calculated from each flight's
/// own state they differed by 1.4e-9 m at most.
inline State step(State state, const Inputs& inputs, const Vehicle& vehicle, double duration,
                  int substeps) {
  const std::vector<double> first_speeds = state.rotor_speeds;
  const double h = duration / substeps;
  const std::size_t most_splits = 2 * vehicle.rotors.size();
  for (int k = 0; k < substeps; ++k) {
    double done = 0.0;
    for (std::size_t splits = 0;; ++splits) {
      const std::vector<int> pieces = calc_loss_pieces(state, inputs, vehicle);
      const auto speeds_at = [&](double tau) {
        return calc_rotor_speeds(vehicle, first_speeds, inputs, k * h + done + tau);
      };
      const auto try_step = [&](double length) {
        return rk4_step(state, speeds_at, length, inputs, vehicle, pieces);
      };
      const State next = try_step(h - done);
      if (splits == most_splits || calc_loss_pieces(next, inputs, vehicle) == pieces) {
        state = next;
        break;
      }
      double before = 0.0, after = h - done;  // of the first change of a piece
      while (after - before > 1e-7 * h) {
        const double middle = 0.5 * (before + after);
        const bool changed = calc_loss_pieces(try_step(middle), inputs, vehicle) != pieces;
        (changed ? after : before) = middle;
      }
      state = try_step(after);
      done += after;
    }
  }
  return state;
}

// Conserved quantities.

/// Kinetic plus potential energy, J.
inline double calc_energy(const State& state, const Vehicle& vehicle) {
  const Body& body = vehicle.body;
  const Point centre = calc_body_point(state, body.p_QC_B);
  double energy = 0.5 * body.mass * centre.v_W.squaredNorm() +
                  0.5 * state.w_WB_B.dot(body.inertia_B * state.w_WB_B) -
                  body.mass * vehicle.gravity * centre.p_W.z();
  const PendulumMass pendulum = calc_mass(vehicle.pendulum);
  const Point rod = calc_rod_point(state, vehicle, pendulum.centre);
  energy += 0.5 * pendulum.mass * rod.v_W.squaredNorm() -
            pendulum.mass * vehicle.gravity * rod.p_W.z() +
            0.5 * pendulum.inertia_across * state.w_WP_P.head<2>().squaredNorm() +
            0.5 * pendulum.inertia_along * state.w_WP_P.z() * state.w_WP_P.z();
  return energy;
}

/// Power of all forces and torques except gravity, W.
inline double calc_power(const State& state, const Inputs& inputs, const Vehicle& vehicle) {
  double power = (inputs.f_Q_W + inputs.disturbance_force_W).dot(state.v_WQ) +
                 inputs.disturbance_torque_W.dot(state.q_WB * state.w_WB_B);
  const std::vector<RotorForces> forces = calc_rotor_forces(state, inputs, vehicle);
  for (std::size_t i = 0; i < forces.size(); ++i) {
    const Point hub = calc_body_point(state, vehicle.rotors[i].p_QR_B);
    power += hub.v_W.dot(state.q_WB * forces[i].force_B) + state.w_WB_B.dot(forces[i].torque_B);
  }
  return power;
}

/// Linear momentum of body and pendulum, kg m/s.
inline Eigen::Vector3d calc_linear_momentum(const State& state, const Vehicle& vehicle) {
  const PendulumMass pendulum = calc_mass(vehicle.pendulum);
  return vehicle.body.mass * calc_body_point(state, vehicle.body.p_QC_B).v_W +
         pendulum.mass * calc_rod_point(state, vehicle, pendulum.centre).v_W;
}

/// Angular momentum of the pendulum about its own centre, kg m²/s.
inline Eigen::Vector3d calc_pendulum_spin(const State& state, const Vehicle& vehicle) {
  const PendulumMass pendulum = calc_mass(vehicle.pendulum);
  const Eigen::Vector3d inertia(pendulum.inertia_across, pendulum.inertia_across,
                                pendulum.inertia_along);
  return state.q_WP * inertia.cwiseProduct(state.w_WP_P);
}

/// Angular momentum of body and pendulum about the fixed point `p_WO`, kg m²/s.
inline Eigen::Vector3d calc_angular_momentum(
    const State& state, const Vehicle& vehicle,
    const Eigen::Vector3d& p_WO = Eigen::Vector3d::Zero()) {
  const PendulumMass pendulum = calc_mass(vehicle.pendulum);
  const Point centre = calc_body_point(state, vehicle.body.p_QC_B);
  const Point rod = calc_rod_point(state, vehicle, pendulum.centre);
  return vehicle.body.mass * (centre.p_W - p_WO).cross(centre.v_W) +
         state.q_WB * (vehicle.body.inertia_B * state.w_WB_B) +
         pendulum.mass * (rod.p_W - p_WO).cross(rod.v_W) + calc_pendulum_spin(state, vehicle);
}

}  // namespace sls::oracle::multirotor
