#include "sim_server/plants/cables/hybrid_motion.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace sls::sim::cables {
namespace {

constexpr double kTimeTolerance = 1e-13;  // of a located event, s
constexpr double kSimultaneous = 1e-10;   // s: cables that arrive within it meet together
constexpr double kTouching = 1e-12;       // m, and m/s per 1 + speed: rounding of 0
constexpr double kRounding = 1e-13;       // of a tension relative to all forces
constexpr int kMostEvents = 64;           // in a step

/// The end of an interval of at most kTimeTolerance in which `value` becomes positive: between
/// `low`, where it is not, and `high`, where it is. Regula falsi (Illinois), every third time
/// bisection.
template <class Value>
double find_crossing(const Value& value, double low, double at_low, double high, double at_high) {
  int side = 0;
  for (int i = 0; i < 150 && high - low > kTimeTolerance; ++i) {
    double time = (low * at_high - high * at_low) / (at_high - at_low);
    if (i % 3 == 2 || !(time > low && time < high)) time = 0.5 * (low + high);
    const double found = value(time);
    if (found > 0.0) {
      high = time;
      at_high = found;
      if (side == 1) at_low *= 0.5;
      side = 1;
    } else {
      low = time;
      at_low = found;
      if (side == -1) at_high *= 0.5;
      side = -1;
    }
  }
  return high;
}

/// Of two lines, with value and slope at 0 and at 1, the value where they cross.
double calc_tangents_crossing(double at_0, double slope_0, double at_1, double slope_1) {
  return at_0 + slope_0 * (at_1 - at_0 - slope_1) / (slope_0 - slope_1);
}

}  // namespace

struct HybridMotion::Found {
  double time = 0.0;
  std::size_t cable = kMaxCables;  // none
  bool is_arrival = false;
};

HybridMotion::HybridMotion(const System& system, const Motion& start)
    : system_(system), all_(Members::all(system.count)) {
  now_.motion = start;
  calc_geometry(system_, now_.motion, all_, now_.geometry);
  // Ends that move apart at the length meet now; the others of these cables do not.
  taut_ = find_candidates(system_, now_.geometry, kLengthTolerance, kLengthTolerance);
  place(taut_, now_);
  const bool meets = std::any_of(taut_.begin(), taut_.end(), [&](std::size_t i) {
    return now_.geometry.stretch_rate[i] > kLengthTolerance;
  });
  if (meets) {
    apply_impact(system_, system_.restitution, taut_, now_.motion);
    calc_geometry(system_, now_.motion, all_, now_.geometry);
    taut_ = find_touching(now_);
  }
  settle(taut_, now_);
  now_.tension.fill(0.0);
  tension_between_.fill(0.0);
}

/// The cables at their length whose ends do not approach.
Members HybridMotion::find_touching(const Instant& instant) const {
  const double speed = instant.motion.v_WL.lpNorm<1>(), place = instant.motion.p_WL.lpNorm<1>();
  return find_candidates(system_, instant.geometry, kTouching * (1.0 + place),
                         kTouching * (1.0 + speed));
}

/// Tensions and accelerations of the taut cables.
void HybridMotion::pull(const Actions& actions, Instant& instant) const {
  calc_free_rate(system_, instant.motion, actions, instant.rate);
  Vector offset;
  calc_offset(system_, instant.motion, instant.geometry, actions, instant.rate, taut_, offset);
  for (const std::size_t i : taut_) offset[i] = -offset[i];
  instant.tension.fill(0.0);
  instant.factor.solve(offset, instant.tension);
  add_pulls(system_, instant.geometry, instant.tension, taut_, instant.rate);
}

/// Brings the `cables` to their length, eq. (8), and computes their geometry and factor.
void HybridMotion::place(const Members& cables, Instant& instant) const {
  Motion& motion = instant.motion;
  Geometry& geometry = instant.geometry;
  if (system_.is_rigid) motion.q_WL /= std::sqrt(motion.q_WL.squaredNorm());
  // Newton's method; the error of a step, of order h⁵, needs one correction.
  constexpr int kMostCorrections = 4;
  for (int corrections = 0;; ++corrections) {
    calc_geometry(system_, motion, all_, geometry);
    hold(cables, instant);
    double error = 0.0;
    for (const std::size_t i : cables) error = std::max(error, std::abs(geometry.stretch[i]));
    const double rounding = 2e-16 * (1.0 + motion.p_WL.lpNorm<1>());
    if (!(error > rounding) || corrections == kMostCorrections) return;
    Vector shift;
    instant.factor.solve(geometry.stretch, shift);
    add_shifts(system_, geometry, shift, cables, motion);
  }
}

/// Also removes the velocities by which the `cables` would lengthen or shorten: eq. (9).
void HybridMotion::settle(const Members& cables, Instant& instant) const {
  place(cables, instant);
  Vector impulses;
  instant.factor.solve(instant.geometry.stretch_rate, impulses);
  add_pulls(system_, instant.geometry, impulses, cables, instant.motion);
  for (const std::size_t i : cables) instant.geometry.stretch_rate[i] = 0.0;
}

void HybridMotion::hold(const Members& cables, Instant& instant) const {
  Matrix matrix;
  calc_matrix(system_, instant.geometry, cables, matrix);
  instant.factor.compute(matrix, cables);
}

/// Which of the `candidates` are taut from now on.
void HybridMotion::choose_taut(const Actions& actions, const Members& candidates) {
  const Accelerations result =
      calc_accelerations(system_, now_.motion, now_.geometry, actions, candidates);
  now_.rate = result.rate;
  now_.tension = result.tension;
  taut_ = result.taut;
  hold(taut_, now_);
}

/// The `cables` are taut from now on, also if they push.
void HybridMotion::keep_taut(const Actions& actions, const Members& cables) {
  taut_ = cables;
  hold(taut_, now_);
  pull(actions, now_);
}

void HybridMotion::integrate(const Actions& actions, double h, Instant& end) {
  // The classical method, with the taut cables held.
  Instant& stage = stage_;
  Motion sum = now_.rate;
  const auto calc_stage = [&](double share, const Motion& rate) {
    add(system_, now_.motion, share * h, rate, stage.motion);
    calc_geometry(system_, stage.motion, taut_, stage.geometry);
    hold(taut_, stage);
    pull(actions, stage);
  };
  calc_stage(0.5, now_.rate);
  add(system_, sum, 2.0, stage.rate, sum);
  calc_stage(0.5, stage.rate);
  add(system_, sum, 2.0, stage.rate, sum);
  tension_between_ = stage.tension;
  calc_stage(1.0, stage.rate);
  add(system_, sum, 1.0, stage.rate, sum);
  add(system_, now_.motion, h / 6.0, sum, end.motion);
  settle(taut_, end);
  pull(actions, end);
}

/// How far cable i violates its mode after `time`: a negative tension, or a distance beyond the
/// length.
double HybridMotion::calc_violation(const Actions& actions, double time, std::size_t i) {
  integrate(actions, time, trial_);
  return taut_.has(i) ? -trial_.tension[i] : trial_.geometry.stretch[i];
}

/// When the tension of cable i becomes negative within `h`; none if it does not.
std::optional<double> HybridMotion::find_slack(const Actions& actions, double h, const Instant& end,
                                               std::size_t i) {
  const double start = now_.tension[i], between = tension_between_[i], last = end.tension[i];
  const double tolerance = kRounding * force_scale_;
  const auto violation = [&](double time) { return calc_violation(actions, time, i); };
  double until = h, at_end = -last;
  if (!(last < -tolerance)) {
    // A dip: by the parabola through the middle, whose tangents at both ends meet below it.
    const double fall = 4.0 * between - 3.0 * start - last,
                 rise = start - 4.0 * between + 3.0 * last;
    if (!(fall < 0.0 && rise > 0.0)) return {};
    if (!(calc_tangents_crossing(start, fall, last, rise) < -tolerance)) return {};
    // Golden section, until a negative tension is found.
    constexpr double kGolden = 0.6180339887498949;
    double low = 0.0, high = h, left = h - kGolden * h, right = kGolden * h;
    double at_left = violation(left), at_right = violation(right);
    for (int k = 0; k < 40 && at_left <= tolerance && at_right <= tolerance; ++k) {
      if (at_left > at_right) {
        high = right;
        right = left;
        at_right = at_left;
        left = high - kGolden * (high - low);
        at_left = violation(left);
      } else {
        low = left;
        left = right;
        at_left = at_right;
        right = low + kGolden * (high - low);
        at_right = violation(right);
      }
    }
    if (at_left <= tolerance && at_right <= tolerance) return {};
    until = at_left > tolerance ? left : right;
    at_end = at_left > tolerance ? at_left : at_right;
  }
  if (start < 0.0) return 0.0;
  return find_crossing(violation, 0.0, -start, until, at_end);
}

/// When the distance of cable i exceeds its length within `h`; none if it does not.
std::optional<double> HybridMotion::find_arrival(const Actions& actions, double h,
                                                 const Instant& end, std::size_t i) {
  const double start = now_.geometry.stretch[i], last = end.geometry.stretch[i];
  const double rate = now_.geometry.stretch_rate[i], last_rate = end.geometry.stretch_rate[i];
  const double tolerance = 0.1 * kTouching * (1.0 + end.motion.p_WL.lpNorm<1>());
  const auto violation = [&](double time) { return calc_violation(actions, time, i); };
  double until = h, at_end = last;
  if (!(last > tolerance)) {
    // A reach beyond the length and back: between, the distance is greatest.
    if (!(rate > 0.0 && last_rate < 0.0)) return {};
    if (!(calc_tangents_crossing(start, rate * h, last, last_rate * h) > tolerance)) return {};
    const auto fall = [&](double time) {
      integrate(actions, time, trial_);
      return -trial_.geometry.stretch_rate[i];
    };
    until = find_crossing(fall, 0.0, -rate, h, -last_rate);
    at_end = violation(until);
    if (!(at_end > tolerance)) return {};
  }
  double from = 0.0, at_start = start;
  if (start >= -tolerance && rate < 0.0) {
    // It just left its length, and comes back: begin where it is away.
    for (from = 0.5 * until; from > kTimeTolerance; from *= 0.5)
      if ((at_start = violation(from)) < 0.0) break;
  }
  if (at_start >= 0.0) return 0.0;
  return find_crossing(violation, from, at_start, until, at_end);
}

HybridMotion::Found HybridMotion::find_first(const Actions& actions, double h, const Instant& end) {
  Found first;
  const Vector between = tension_between_;
  for (std::size_t i = 0; i < system_.count; ++i) {
    const bool is_taut = taut_.has(i);
    if (is_taut && is_stuck_) continue;
    tension_between_ = between;  // a search overwrites it
    const auto time = is_taut ? find_slack(actions, h, end, i) : find_arrival(actions, h, end, i);
    if (time && (first.cable == kMaxCables || *time < first.time)) first = {*time, i, !is_taut};
  }
  return first;
}

/// The cable `cable` reaches its length, with others.
void HybridMotion::meet(const Actions& actions, double time, std::size_t cable,
                        std::vector<Event>& events) {
  const Geometry& geometry = now_.geometry;
  Members meeting = taut_;
  meeting.add(cable);
  const Members before = taut_;
  // Ends that approach so slowly that they would not get away by more than rounding stay.
  const bool stays = geometry.stretch_rate[cable] < 0.0;
  if (is_stuck_ || stays) {
    settle(meeting, now_);
    calc_geometry(system_, now_.motion, all_, now_.geometry);
    if (is_stuck_)
      keep_taut(actions, meeting);
    else
      choose_taut(actions, meeting);
    report(before, time, events);
    return;
  }
  for (const std::size_t i : all_)
    if (geometry.stretch[i] >= -kTouching ||
        geometry.stretch[i] + kSimultaneous * geometry.stretch_rate[i] >= 0.0)
      meeting.add(i);
  place(meeting, now_);
  const Vector impulses = apply_impact(system_, system_.restitution, meeting, now_.motion);
  for (const std::size_t i : meeting)
    if (impulses[i] > 0.0 && !before.has(i))
      events.push_back({Event::Kind::kTaut, i, time, impulses[i]});
  calc_geometry(system_, now_.motion, all_, now_.geometry);
  choose_taut(actions, find_touching(now_));
  Members were_taut = before;
  for (const std::size_t i : meeting)
    if (impulses[i] > 0.0) were_taut.add(i);
  report(were_taut, time, events);
}

/// The tension of the cable `cable` becomes negative.
void HybridMotion::slacken(const Actions& actions, double time, std::size_t cable,
                           std::vector<Event>& events) {
  const Members before = taut_;
  Members candidates = find_touching(now_);
  for (const std::size_t i : taut_) candidates.add(i);
  choose_taut(actions, candidates);
  if (taut_ == before) {  // the tension is rounding of 0
    Members others = before;
    others.remove(cable);
    keep_taut(actions, others);
  }
  report(before, time, events);
}

/// Reports the cables that became taut or slack since `before`.
void HybridMotion::report(const Members& before, double time, std::vector<Event>& events) const {
  for (const std::size_t i : all_)
    if (before.has(i) != taut_.has(i))
      events.push_back({taut_.has(i) ? Event::Kind::kTaut : Event::Kind::kSlack, i, time, 0.0});
}

void HybridMotion::step(const Actions& actions, double h, std::vector<Event>& events) {
  is_stuck_ = false;
  force_scale_ = 0.0;
  for (std::size_t i = 0; i < system_.count; ++i)
    force_scale_ += system_.vehicle_mass[i] * system_.gravity + actions.f_Q_W[i].lpNorm<1>();
  // Forces jump between steps: which cables pull now?
  pull(actions, now_);
  Members candidates = find_touching(now_);
  const bool has_slackened = std::any_of(taut_.begin(), taut_.end(), [&](std::size_t i) {
    return now_.tension[i] < -kRounding * force_scale_;
  });
  for (const std::size_t i : taut_) candidates.add(i);
  if (has_slackened || !(candidates == taut_)) {
    const Members before = taut_;
    choose_taut(actions, candidates);
    report(before, 0.0, events);
  }
  double time = 0.0;
  for (int count = 1;; ++count) {
    const double rest = h - time;
    integrate(actions, rest, then_);
    const Found found = find_first(actions, rest, then_);
    if (found.cable == kMaxCables) break;
    integrate(actions, found.time, then_);
    std::swap(now_, then_);
    time += found.time;
    if (found.is_arrival)
      meet(actions, time, found.cable, events);
    else
      slacken(actions, time, found.cable, events);
    if (count == kMostEvents) {
      is_stuck_ = true;
      events.push_back({Event::Kind::kStuck, found.cable, time, 0.0});
    }
    if (time >= h) return;
  }
  std::swap(now_, then_);
}

}  // namespace sls::sim::cables
