#include "sim_server/plants/cables/hybrid_motion.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

#include "sim_server/plants/cables/event_search.hpp"

namespace sls::sim::cables {
namespace {

constexpr double kSimultaneous = 1e-10;  // s: cables that arrive within it meet together
constexpr double kTouching = 1e-12;      // m, and m/s per 1 + speed: rounding of 0
constexpr double kRounding = 1e-13;      // of a tension relative to all forces
constexpr int kMostEvents = 64;          // in a step
constexpr double kDrift = 1e-11;         // m: of a cable in a step, before eq. (8)

/// Whether a cable can move something: not between a vehicle and a load that both stand.
bool moves(std::size_t cable, const Members& standing) {
  return standing.empty() || !standing.has(kLoad) || !standing.has(cable);
}

/// Those of the `cables` that can move something.
Members find_moving(const Members& cables, const Members& standing) {
  if (standing.empty()) return cables;
  Members moving;
  for (const std::size_t i : cables)
    if (moves(i, standing)) moving.add(i);
  return moving;
}

double get_z(const Motion& motion, std::size_t body) {
  return (body == kLoad ? motion.p_WL : motion.vehicles[body].p_W).z();
}

double get_fall(const Motion& motion, std::size_t body) {
  return (body == kLoad ? motion.v_WL : motion.vehicles[body].v_W).z();
}

double get_mass(const System& system, std::size_t body) {
  return body == kLoad ? system.load_mass : system.vehicle_mass[body];
}

Members without(Members some, std::size_t one) {
  some.remove(one);
  return some;
}

void stop(const Members& bodies, Motion& motion) {
  for (const std::size_t body : bodies) {
    (body == kLoad ? motion.v_WL : motion.vehicles[body].v_W).setZero();
    (body == kLoad ? motion.w_WL_L : motion.turns[body].w_WB_B).setZero();
  }
}

Members unite(Members some, const Members& others) {
  for (const std::size_t i : others) some.add(i);
  return some;
}

Members find_bodies(const System& system) {
  if (!system.ground_z_W) return {};
  Members bodies = Members::all(system.count);
  bodies.add(kLoad);
  return bodies;
}

/// The energy that lifts the lightest body by the longest cable, J. Where things hardly weigh
/// anything, as if g were 1 m/s².
double calc_energy_scale(const System& system, const Motion& motion) {
  double mass = system.load_mass, length = 0.0;
  for (std::size_t i = 0; i < system.count; ++i) {
    mass = std::min(mass, system.vehicle_mass[i]);
    length = std::max(length, motion.vehicles[i].length);
  }
  return mass * std::max(system.gravity, 1.0) * length;
}

Members find_stiff(const System& system) {
  Members stiff;
  for (std::size_t i = 0; i < system.count; ++i)
    if (!(system.stiffness[i] > 0.0)) stiff.add(i);
  return stiff;
}

}  // namespace

struct HybridMotion::Found {
  double time = 0.0;
  Limit limit;
};

Members HybridMotion::Mode::get_pulling() const {
  return stretched.empty() ? taut : unite(taut, stretched);
}

HybridMotion::HybridMotion(const System& system, const Motion& start)
    : system_(system),
      held_(system),
      uncut_(Members::all(system.count)),
      stiff_(find_stiff(system)),
      bodies_(find_bodies(system)),
      inverse_energy_scale_(1.0 / calc_energy_scale(system, start)) {
  now().tension.fill(0.0);
  now().ground.fill(0.0);
  stage_.ground.fill(0.0);
  between_ = now();
  now().motion = start;
  Members landing;
  for (const std::size_t body : bodies_)
    if (get_z(start, body) >= *system_.ground_z_W - kLengthTolerance &&
        get_fall(start, body) >= 0.0)
      landing.add(body);
  calc_geometry(system_, now().motion, uncut_, now().geometry);
  // Ends that move apart at the length meet now; the others of these cables do not.
  mode_.taut = find_moving(
      find_candidates(stiff_, now().geometry, kLengthTolerance, kLengthTolerance), landing);
  for (const std::size_t i : uncut_)
    if (stretches(i) && calc_spring_stretch(now(), i) > 0.0) mode_.stretched.add(i);
  put_on_ground(landing);
  place(mode_.taut, now());
  const bool meets = std::any_of(mode_.taut.begin(), mode_.taut.end(), [&](std::size_t i) {
    return now().geometry.stretch_rate[i] > kLengthTolerance;
  });
  if (meets || !landing.empty()) {
    hit(mode_.taut);
    calc_geometry(held_, now().motion, uncut_, now().geometry);
    mode_.taut = find_touching(now());
  }
  settle(mode_.taut, now());
}

bool HybridMotion::holds(const Limit& limit) const {
  if (limit.of == Limit::Of::kBody) return mode_.standing.has(limit.index);
  return mode_.taut.has(limit.index) || mode_.stretched.has(limit.index);
}

/// How far something is beyond its limit, m.
double HybridMotion::calc_excess(const Instant& instant, const Limit& limit) const {
  if (limit.of == Limit::Of::kCable) return instant.geometry.stretch[limit.index];
  return get_z(instant.motion, limit.index) - *system_.ground_z_W;
}

double HybridMotion::calc_excess_rate(const Instant& instant, const Limit& limit) const {
  if (limit.of == Limit::Of::kCable) return instant.geometry.stretch_rate[limit.index];
  return get_fall(instant.motion, limit.index);
}

void HybridMotion::set_standing(const Members& standing) {
  if (standing == mode_.standing) return;
  mode_.standing = standing;
  held_ = hold_still(system_, standing);
}

/// The `bodies`, which are at the ground, stand on it.
void HybridMotion::put_on_ground(const Members& bodies) {
  Motion& motion = now().motion;
  for (const std::size_t body : bodies)
    (body == kLoad ? motion.p_WL : motion.vehicles[body].p_W).z() = *system_.ground_z_W;
  set_standing(unite(mode_.standing, bodies));
}

/// The cables at their length whose ends neither approach nor move apart: where those of a slack
/// one do, it arrives, and an impact follows.
Members HybridMotion::find_touching(const Instant& instant) const {
  const double speed = instant.motion.v_WL.lpNorm<1>(), place = instant.motion.p_WL.lpNorm<1>();
  const double least = -kTouching * (1.0 + place), rounding = kTouching * (1.0 + speed);
  const Geometry& geometry = instant.geometry;
  Members touching;
  for (const std::size_t i : stiff_)
    if (geometry.stretch[i] >= least && std::abs(geometry.stretch_rate[i]) <= rounding)
      touching.add(i);
  return find_moving(touching, mode_.standing);
}

/// The actions at an instant: with rotors, their forces and torques.
const Actions& HybridMotion::act(const Actions& actions, const Instant& instant) const {
  if (!actions.propulsion) return actions;
  actions.propulsion->push(instant.motion, instant.rotors, acting_);
  return acting_;
}

/// Forces and accelerations, with the taut cables at their length and the standing bodies still.
void HybridMotion::pull(const Actions& held, Instant& instant) const {
  const Actions& actions = act(held, instant);
  calc_free_rate(held_, instant.motion, actions, instant.rate);
  instant.tension.fill(0.0);
  if (!mode_.stretched.empty())
    add_springs(held_, instant.geometry, mode_.stretched, instant.tension, instant.rate);
  Vector offset;
  calc_offset(held_, instant.motion, instant.geometry, actions, instant.rate, mode_.taut, offset);
  for (const std::size_t i : mode_.taut) offset[i] = -offset[i];
  instant.factor.solve(offset, instant.tension);
  add_pulls(held_, instant.geometry, instant.tension, mode_.taut, instant.rate);
  if (!mode_.standing.empty()) support(actions, instant);
}

/// The forces of the ground; README.md, eq. (11). `actions` are those at the instant.
void HybridMotion::support(const Actions& actions, Instant& instant) const {
  for (const std::size_t body : mode_.standing) {
    double& force = instant.ground[body];
    if (body == kLoad) {
      force = system_.load_mass * system_.gravity;
      for (const std::size_t i : mode_.get_pulling())
        force -= instant.tension[i] * instant.geometry.n_W[i].z();
    } else {
      force = system_.vehicle_mass[body] * system_.gravity +
              calc_force(actions, instant.motion.vehicles[body], body).z();
      if (mode_.get_pulling().has(body))
        force += instant.tension[body] * instant.geometry.n_W[body].z();
    }
  }
}

/// Brings the `cables` to their length, eq. (8), and computes their geometry and factor. Returns
/// how far one was from it, m.
double HybridMotion::place(const Members& cables, Instant& instant) const {
  Motion& motion = instant.motion;
  Geometry& geometry = instant.geometry;
  if (system_.is_rigid && !mode_.standing.has(kLoad))
    motion.q_WL /= std::sqrt(motion.q_WL.squaredNorm());
  if (system_.has_attitude)
    for (std::size_t i = 0; i < system_.count; ++i) {
      Eigen::Vector4d& q = motion.turns[i].q_WB;
      if (!mode_.standing.has(i)) q /= std::sqrt(q.squaredNorm());
    }
  // Newton's method; the error of a step, of order h⁵, needs one correction.
  constexpr int kMostCorrections = 4;
  double first_error = 0.0;
  for (int corrections = 0;; ++corrections) {
    calc_geometry(held_, motion, uncut_, geometry);
    hold(cables, instant);
    double error = 0.0;
    for (const std::size_t i : cables) error = std::max(error, std::abs(geometry.stretch[i]));
    const double rounding = 2e-16 * (1.0 + motion.p_WL.lpNorm<1>());
    if (corrections == 0) first_error = error;
    if (!(error > rounding) || corrections == kMostCorrections) return first_error;
    Vector shift;
    instant.factor.solve(geometry.stretch, shift);
    add_shifts(held_, geometry, shift, cables, motion);
  }
}

/// Also removes the velocities by which the `cables` would lengthen or shorten: eq. (9).
double HybridMotion::settle(const Members& cables, Instant& instant) const {
  const double error = place(cables, instant);
  Vector impulses;
  instant.factor.solve(instant.geometry.stretch_rate, impulses);
  add_pulls(held_, instant.geometry, impulses, cables, instant.motion);
  for (const std::size_t i : cables) instant.geometry.stretch_rate[i] = 0.0;
  return error;
}

void HybridMotion::hold(const Members& cables, Instant& instant) const {
  Matrix matrix;
  calc_matrix(held_, instant.geometry, cables, matrix);
  instant.factor.compute(matrix, cables);
}

/// By how much a standing body is pulled off, N: > 0 only if the vertical forces exceed its weight
/// and, set free, it would rise. README.md, "Ground".
double HybridMotion::calc_lift(const Actions& actions, const Instant& instant,
                               std::size_t body) const {
  const double pulled = -instant.ground[body];
  if (!(pulled > 0.0)) return pulled;
  const Members standing = without(mode_.standing, body);
  const System freed = hold_still(system_, standing);
  Geometry geometry;
  calc_geometry(freed, instant.motion, uncut_, geometry);
  const Members candidates = find_moving(
      unite(find_candidates(stiff_, geometry, kLengthTolerance, kLengthTolerance), mode_.taut),
      standing);
  const Motion rate = calc_accelerations(freed, instant.motion, geometry, act(actions, instant),
                                         candidates, mode_.stretched)
                          .rate;
  // A rate holds accelerations where a motion holds velocities.
  return std::min(pulled, get_mass(system_, body) * -get_fall(rate, body));
}

/// The `cables` are taut from now on, also if they push.
void HybridMotion::keep(const Actions& actions, const Members& cables) {
  mode_.taut = cables;
  hold(cables, now());
  pull(actions, now());
}

/// Which of the `candidates` are taut from now on, with the standing bodies still.
void HybridMotion::solve(const Actions& actions, const Members& candidates) {
  const Accelerations result = calc_accelerations(held_, now().motion, now().geometry,
                                                  act(actions, now()), candidates, mode_.stretched);
  now().rate = result.rate;
  now().tension = result.tension;
  mode_.taut = result.taut;
  hold(mode_.taut, now());
}

/// Which of the `candidates` are taut, and which bodies still stand, from now on.
void HybridMotion::choose(const Actions& actions, const Members& candidates) {
  solve(actions, find_moving(candidates, mode_.standing));
  while (!mode_.standing.empty()) {
    support(act(actions, now()), now());
    const auto* rising =
        std::find_if(mode_.standing.begin(), mode_.standing.end(), [&](std::size_t body) {
          return calc_lift(actions, now(), body) > kRounding * force_scale_;
        });
    if (rising == mode_.standing.end()) return;
    set_free(*rising);
    solve(actions, find_moving(unite(candidates, find_touching(now())), mode_.standing));
  }
}

void HybridMotion::set_free(std::size_t body) {
  set_standing(without(mode_.standing, body));
  calc_geometry(held_, now().motion, uncut_, now().geometry);
}

/// An impact: impulses along the cables `meeting`, and of the ground, which stops the standing
/// bodies unless cables pull them off. Returns the impulses of the cables.
Vector HybridMotion::hit(const Members& meeting) {
  const Motion before = now().motion;
  Vector impulses;
  const auto fly_on = [&](const Members& standing) {
    set_standing(standing);
    now().motion = before;
    stop(standing, now().motion);
    impulses =
        apply_impact(held_, system_.restitution, find_moving(meeting, standing), now().motion);
  };
  fly_on(mode_.standing);
  for (Members tried; tried.size() < mode_.standing.size();) {
    const auto* next = std::find_if(mode_.standing.begin(), mode_.standing.end(),
                                    [&](std::size_t body) { return !tried.has(body); });
    const std::size_t body = *next;
    tried.add(body);
    // The impulse with which the ground stops the body.
    double down = get_mass(system_, body) * get_fall(before, body);
    double scale = std::abs(down);
    for (const std::size_t i : meeting) {
      if (body != kLoad && body != i) continue;
      const double along = impulses[i] * now().geometry.n_W[i].z();
      down += body == kLoad ? -along : along;
      scale += impulses[i];
    }
    if (!(down < -kRounding * scale)) continue;
    const Members standing = mode_.standing;
    fly_on(without(standing, body));
    if (get_fall(now().motion, body) < 0.0)
      tried = {};  // it rises; the other bodies feel other impulses
    else
      fly_on(standing);
  }
  return impulses;
}

void HybridMotion::integrate(const Actions& actions, double h, Instant& end) {
  // The classical method, with the taut cables held.
  Instant& stage = stage_;
  if (actions.propulsion)
    actions.propulsion->turn(now().rotors, h, stage.rotors, ending_, end.rotors);
  Motion sum;
  double power = 0.0;  // six times the mean of what the forces give
  const auto add_power = [&](double weight, const Instant& at) {
    if (!does_work_vary_) return;
    power += weight * calc_power(system_, at.motion, at.rate);
    for (const std::size_t i : mode_.stretched)  // what springs take, they keep
      power += weight * system_.stiffness[i] * at.geometry.stretch[i] * at.geometry.stretch_rate[i];
  };
  add_power(1.0, now());
  if (!mode_.stretched.empty()) united_ = mode_.get_pulling();
  const Members& pulling = mode_.stretched.empty() ? mode_.taut : united_;
  const auto calc_stage = [&](double share, const Motion& rate) {
    add(system_, now().motion, share * h, rate, stage.motion);
    calc_geometry(held_, stage.motion, pulling, stage.geometry);
    hold(mode_.taut, stage);
    pull(actions, stage);
  };
  calc_stage(0.5, now().rate);
  add_power(2.0, stage);
  add(system_, now().rate, 2.0, stage.rate, sum);
  calc_stage(0.5, stage.rate);
  add_power(2.0, stage);
  add(system_, sum, 2.0, stage.rate, sum);
  between_.tension = stage.tension;
  if (!mode_.standing.empty()) between_.ground = stage.ground;
  stage.rotors.swap(ending_);
  calc_stage(1.0, stage.rate);
  add(system_, sum, 1.0, stage.rate, sum);
  add_power(1.0, stage);
  end.work = h / 6.0 * power;
  add(system_, now().motion, h / 6.0, sum, end.motion);
  end.drift = settle(mode_.taut, end);
  pull(actions, end);
}

/// Compares the change of energy in the part of a step that ends then with the work: eq. (18).
/// Held forces and cables that kept their length give no error worth its cost.
void HybridMotion::note_energy_error(const Actions& actions) {
  if (!does_work_vary_ && !(then().drift > kDrift)) return;
  const Motion &start = now().motion, &end = then().motion;
  const double work = does_work_vary_ ? then().work : calc_held_work(system_, actions, start, end);
  double gained = calc_kinetic_change(system_, start, end) - work;
  for (const std::size_t i : mode_.stretched) {
    const double before = now().geometry.stretch[i], after = then().geometry.stretch[i];
    gained += 0.5 * system_.stiffness[i] * (after - before) * (after + before);
  }
  energy_gain_ += gained * inverse_energy_scale_;
}

/// How far a limit that holds is lost, N: by a negative tension, or a lift.
double HybridMotion::calc_loss(const Actions& actions, const Instant& instant,
                               const Limit& limit) const {
  if (limit.of == Limit::Of::kCable) return -instant.tension[limit.index];
  return calc_lift(actions, instant, limit.index);
}

/// When a limit that holds is lost within `h`, because its force becomes negative; none if not.
std::optional<double> HybridMotion::find_loss(const Actions& actions, double h,
                                              const Holding& middle, const Instant& end,
                                              const Limit& limit) {
  const auto force = [&](const Holding& at) {
    return limit.of == Limit::Of::kCable ? at.tension[limit.index] : at.ground[limit.index];
  };
  const double start = force(now()), between = force(middle), last = force(end);
  const double tolerance = kRounding * force_scale_;
  const auto violation = [&](double time) {
    integrate(actions, time, trial_);
    return calc_loss(actions, trial_, limit);
  };
  double until = h, at_end = calc_loss(actions, end, limit);
  if (!(at_end > tolerance)) {
    // A dip: by the parabola through the middle, whose tangents at both ends meet below it.
    const double fall = 4.0 * between - 3.0 * start - last,
                 rise = start - 4.0 * between + 3.0 * last;
    if (!(fall < 0.0 && rise > 0.0)) return {};
    if (!(calc_tangents_crossing(start, fall, last, rise) < -tolerance)) return {};
    // Thirds, until a negative tension is found.
    double low = 0.0, high = h;
    for (int k = 0; k < 40 && !(at_end > tolerance); ++k) {
      const double left = (2.0 * low + high) / 3.0, right = (low + 2.0 * high) / 3.0;
      const double at_left = violation(left), at_right = violation(right);
      const bool is_left = at_left > at_right;
      until = is_left ? left : right;
      at_end = is_left ? at_left : at_right;
      (is_left ? high : low) = is_left ? right : left;
    }
    if (!(at_end > tolerance)) return {};
  }
  const double at_start = calc_loss(actions, now(), limit);
  if (at_start > 0.0) return 0.0;
  return find_crossing(violation, 0.0, at_start, until, at_end);
}

/// When a limit that does not hold is reached within `h`; none if it is not.
std::optional<double> HybridMotion::find_arrival(const Actions& actions, double h,
                                                 const Instant& end, const Limit& limit) {
  const double start = calc_excess(now(), limit), last = calc_excess(end, limit);
  const double rate = calc_excess_rate(now(), limit), last_rate = calc_excess_rate(end, limit);
  const double tolerance = 0.1 * kTouching * (1.0 + end.motion.p_WL.lpNorm<1>());
  const auto violation = [&](double time) {
    integrate(actions, time, trial_);
    return calc_excess(trial_, limit);
  };
  double until = h, at_end = last;
  if (!(last > tolerance)) {
    // A reach beyond the length and back: between, the distance is greatest.
    if (!(rate > 0.0 && last_rate < 0.0)) return {};
    if (!(calc_tangents_crossing(start, rate * h, last, last_rate * h) > tolerance)) return {};
    const auto fall = [&](double time) {
      integrate(actions, time, trial_);
      return -calc_excess_rate(trial_, limit);
    };
    until = find_crossing(fall, 0.0, -rate, h, -last_rate);
    at_end = violation(until);
    if (!(at_end > tolerance)) return {};
  }
  const bool leaves = limit.of == Limit::Of::kCable ? rate < 0.0 : rate <= 0.0;
  const bool returns = start >= -tolerance && leaves;  // it just left its limit, and comes back
  if (start >= 0.0 && !returns) return 0.0;
  // By a parabola it gets away by (rate until / 2)² / at_end at most.
  const double way = 0.5 * rate * until;
  if (returns && rate < 0.0 && way * way <= tolerance * at_end) return 0.0;
  if (returns || is_later_) {
    const auto find = [&](double time) {
      const double value = violation(time);
      return Slope{value, calc_excess_rate(trial_, limit)};
    };
    return find_rise(find, {start, rate}, until, at_end, 1e-2 * tolerance);
  }
  // The first event of a step keeps its own search: the last bits of recordings depend on it.
  return find_crossing(violation, 0.0, start, until, at_end);
}

/// How far a cable that stretches pulls, as a length: > 0 where (19) has a tension.
double HybridMotion::calc_spring_stretch(const Instant& instant, std::size_t cable) const {
  const double stretch = instant.geometry.stretch[cable];
  const double late = system_.damping[cable] / system_.stiffness[cable];
  return std::min(stretch, stretch + late * instant.geometry.stretch_rate[cable]);
}

/// When a cable that stretches begins to pull within `h`; none if it does not.
std::optional<double> HybridMotion::find_stretch(const Actions& actions, double h,
                                                 const Instant& end, std::size_t cable) {
  const auto value = [&](double time) {
    integrate(actions, time, trial_);
    return calc_spring_stretch(trial_, cable);
  };
  const double start = calc_spring_stretch(now(), cable);
  double until = h, at_end = calc_spring_stretch(end, cable);
  if (!(at_end > 0.0)) {
    // It can reach its length and go back: between, the distance is greatest.
    const double rate = now().geometry.stretch_rate[cable];
    const double last_rate = end.geometry.stretch_rate[cable];
    if (!(rate > 0.0 && last_rate < 0.0)) return {};
    until = find_crossing(
        [&](double time) {
          integrate(actions, time, trial_);
          return -trial_.geometry.stretch_rate[cable];
        },
        0.0, -rate, h, -last_rate);
    at_end = value(until);
    if (!(at_end > 0.0)) return {};
  }
  if (start >= 0.0) return 0.0;
  return find_crossing(value, 0.0, start, until, at_end);
}

/// Flies to the first event within `h`, or to its end.
HybridMotion::Found HybridMotion::find_first(const Actions& actions, double h) {
  integrate(actions, h, then());
  Holding middle = between_;  // a search overwrites it
  Found first{h, {}};
  const auto look = [&](const Limit& limit) {
    const bool is_held = holds(limit);
    if (is_held && is_stuck_) return;
    const bool is_spring = limit.of == Limit::Of::kCable && stretches(limit.index);
    const auto time = is_held     ? find_loss(actions, first.time, middle, then(), limit)
                      : is_spring ? find_stretch(actions, first.time, then(), limit.index)
                                  : find_arrival(actions, first.time, then(), limit);
    if (!time || (first.limit.of != Limit::Of::kNothing && !(*time < first.time))) return;
    first = {*time, limit};
    // Later events do not count.
    integrate(actions, first.time, then());
    middle = between_;
  };
  for (const std::size_t i : uncut_)
    if (moves(i, mode_.standing) || stretches(i)) look({Limit::Of::kCable, i});
  for (const std::size_t body : bodies_) look({Limit::Of::kBody, body});
  return first;
}

/// A cable reaches its length, or a body the ground, with others.
void HybridMotion::meet(const Actions& actions, double time, const Limit& limit,
                        std::vector<Event>& events) {
  const Geometry& geometry = now().geometry;
  const Mode before = mode_;
  if (limit.of == Limit::Of::kCable && stretches(limit.index)) {  // without an impact
    mode_.stretched.add(limit.index);
    choose(actions, unite(find_touching(now()), mode_.taut));
    return report(before, time, events);
  }
  Members meeting = mode_.taut, landing;
  (limit.of == Limit::Of::kCable ? meeting : landing).add(limit.index);
  // Ends that approach so slowly that they would not get away by more than rounding stay.
  const bool stays = calc_excess_rate(now(), limit) < 0.0;
  if (is_stuck_ || stays) {
    put_on_ground(landing);
    stop(landing, now().motion);
    meeting = find_moving(meeting, mode_.standing);
    settle(meeting, now());
    calc_geometry(held_, now().motion, uncut_, now().geometry);
    if (is_stuck_)
      keep(actions, meeting);
    else
      choose(actions, meeting);
    report(before, time, events);
    return;
  }
  for (const std::size_t i : stiff_)
    if (geometry.stretch[i] >= -kTouching ||
        geometry.stretch[i] + kSimultaneous * geometry.stretch_rate[i] >= 0.0)
      meeting.add(i);
  for (const std::size_t body : bodies_) {
    const double below = get_z(now().motion, body) - *system_.ground_z_W;
    const double fall = get_fall(now().motion, body);
    if (fall > 0.0 && below + std::max(kTouching, kSimultaneous * fall) >= 0.0) landing.add(body);
  }
  put_on_ground(landing);
  place(find_moving(meeting, mode_.standing), now());
  const Vector impulses = hit(meeting);
  for (const std::size_t i : meeting)
    if (impulses[i] > 0.0 && !before.taut.has(i))
      events.push_back({Event::Kind::kTaut, i, time, impulses[i]});
  calc_geometry(held_, now().motion, uncut_, now().geometry);
  choose(actions, find_touching(now()));
  Mode known = before;
  for (const std::size_t i : meeting)
    if (impulses[i] > 0.0) known.taut.add(i);
  report(known, time, events);
}

/// A force that holds becomes negative: the cable goes slack, or the body lifts off.
void HybridMotion::let_go(const Actions& actions, double time, const Limit& limit,
                          std::vector<Event>& events) {
  const Mode before = mode_;
  if (limit.of == Limit::Of::kBody) set_free(limit.index);
  const bool is_spring = limit.of == Limit::Of::kCable && stretches(limit.index);
  if (is_spring) mode_.stretched.remove(limit.index);
  const Members candidates = unite(find_touching(now()), mode_.taut);
  choose(actions, candidates);
  if (limit.of == Limit::Of::kCable && !is_spring && mode_.taut == before.taut)  // rounding of 0
    keep(actions, without(before.taut, limit.index));
  report(before, time, events);
}

/// Reports the cables that became taut or slack since `before`, and the bodies that came to stand
/// or lifted off.
void HybridMotion::report(const Mode& before, double time, std::vector<Event>& events) const {
  using Kind = Event::Kind;
  const Members pulled = before.get_pulling(), pulling = mode_.get_pulling();
  for (const std::size_t i : uncut_)
    if (pulled.has(i) != pulling.has(i))
      events.push_back({pulling.has(i) ? Kind::kTaut : Kind::kSlack, i, time, 0.0});
  for (const std::size_t body : bodies_)
    if (before.standing.has(body) != mode_.standing.has(body))
      events.push_back(
          {mode_.standing.has(body) ? Kind::kTouchDown : Kind::kLiftOff, body, time, 0.0});
}

void HybridMotion::set_length(std::size_t cable, double length, double rate) {
  now().motion.vehicles[cable].length = length;
  now().motion.vehicles[cable].length_rate = rate;
}

void HybridMotion::cut(std::size_t cable) {
  uncut_.remove(cable);
  stiff_.remove(cable);
  mode_.taut.remove(cable);
  mode_.stretched.remove(cable);
  hold(mode_.taut, now());
}

void HybridMotion::step(const Actions& actions, double h, std::vector<Event>& events) {
  is_stuck_ = false;
  force_scale_ = 0.0;
  if (actions.propulsion) acting_ = actions;
  const Actions& first = act(actions, now());
  for (std::size_t i = 0; i < system_.count; ++i)
    force_scale_ += system_.vehicle_mass[i] * system_.gravity + first.f_Q_W[i].lpNorm<1>();
  // Forces jump between steps: which cables pull now?
  pull(actions, now());
  const auto pushes = [&](std::size_t i) { return now().tension[i] < -kRounding * force_scale_; };
  const auto lifts = [&](std::size_t body) {
    return calc_lift(actions, now(), body) > kRounding * force_scale_;
  };
  const Members &taut = mode_.taut, &standing = mode_.standing;
  const Members candidates = unite(find_touching(now()), taut);
  if (std::any_of(taut.begin(), taut.end(), pushes) || !(candidates == taut) ||
      std::any_of(standing.begin(), standing.end(), lifts)) {
    const Mode before = mode_;
    choose(actions, candidates);
    report(before, 0.0, events);
  }
  energy_gain_ *= std::max(0.0, 1.0 - h);
  const auto winds = [&](std::size_t i) {
    return actions.length_acceleration[i] != 0.0 || now().motion.vehicles[i].length_rate != 0.0;
  };
  does_work_vary_ = actions.propulsion || actions.air.rotor_drag != 0.0 ||
                    actions.load_drag.acts() || stiff_.size() < uncut_.size() ||
                    std::any_of(uncut_.begin(), uncut_.end(), winds);
  double time = 0.0;
  for (int count = 1;; ++count) {
    is_later_ = count > 1;
    const Found found = find_first(actions, h - time);
    note_energy_error(actions);
    now_at_ = 1 - now_at_;
    if (found.limit.of == Limit::Of::kNothing) break;
    time += found.time;
    if (holds(found.limit))
      let_go(actions, time, found.limit, events);
    else
      meet(actions, time, found.limit, events);
    if (count == kMostEvents) {
      is_stuck_ = true;
      events.push_back({Event::Kind::kStuck, found.limit.index, time, 0.0});
    }
    if (time >= h) break;
  }
  if (is_stuck_ && std::any_of(taut.begin(), taut.end(), pushes)) {
    const Mode before = mode_;
    choose(actions, unite(find_touching(now()), taut));
    report(before, h, events);
  }
  check_held();
}

/// Nothing is there to move if the cable between a vehicle and a load that stand shortens.
void HybridMotion::check_held() const {
  if (!mode_.standing.has(kLoad)) return;
  for (const std::size_t i : stiff_)
    if (mode_.standing.has(i) && now().geometry.stretch[i] > kLengthTolerance)
      throw std::runtime_error("cable " + std::to_string(i) +
                               ": its winch pulls at a vehicle and a load that both stand on the "
                               "ground, which holds them");
}

}  // namespace sls::sim::cables
