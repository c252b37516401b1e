#include "control_client/laws/qsf/slack.hpp"

#include <algorithm>
#include <cmath>

#include "common/model/dot.hpp"
#include "common/model/shared_load.hpp"

namespace sls::control {

using Eigen::Vector2d;
using Eigen::Vector3d;
using model::SharedLoad;

SlackRule::Chord::Chord(const model::Measurement& state)
    : r_W(state.p_WL - state.p_WQ), r_dot_W(state.v_WL - state.v_WQ) {
  distance = std::sqrt(r_W.squaredNorm());
  if (distance > 0.0) n_W = r_W / distance;
}

bool SlackRule::applies(const model::Measurement& state) const {
  constexpr double kLeastCosine = 0.5;
  return state.signals[SharedLoad::kTaut] == 0.0 || Chord(state).n_W.z() < kLeastCosine;
}

Vector3d SlackRule::limit_rate(const Vector3d& a_W, const Chord& chord) const {
  const double rate = model::dot(chord.n_W, chord.r_dot_W);
  const double across = (chord.r_dot_W - rate * chord.n_W).squaredNorm();
  // A load that passes close by has its whole cable to run: the denominator bounds the term.
  const double turning = across / std::max(chord.distance, 0.1 * vehicle_.rod_length);
  const double per_second = std::min(2.0 * vehicle_.gravity / retaut_rate_, 1.0 / period_);
  const double least =
      vehicle_.gravity * chord.n_W.z() + turning - per_second * (retaut_rate_ - rate);
  return a_W + std::max(0.0, least - model::dot(chord.n_W, a_W)) * chord.n_W;  // eq. (14)
}

Vector3d SlackRule::calc_force(const model::Measurement& state,
                               const model::Reference& reference) const {
  const double g = vehicle_.gravity, length = vehicle_.rod_length;
  const Vector3d above_W(0.0, 0.0, length);
  const bool is_cut = released_ && state.signals[*released_] == 1.0;
  const Chord chord(state);
  // Eqs. (12) and (13): where the vehicle belongs, and where it is.
  const Vector3d e = state.p_WQ + above_W - reference.position;
  const Vector3d e_dot = state.v_WQ - reference.velocity;
  Vector2d aside = chord.n_W.z() > 0.0 ? chord.r_W.head<2>() : Vector2d(0.0, 0.0);
  Vector2d aside_dot = chord.r_dot_W.head<2>();
  if (is_cut) {
    aside = -e.head<2>();
    aside_dot = -e_dot.head<2>();
  }
  const Vector2d level = 4.0 * g / length * aside + 4.0 * std::sqrt(g / length) * aside_dot;
  Vector3d a_W(level.x(), level.y(),
               reference.acceleration.z() - gains_.velocity * e_dot.z() - gains_.position * e.z());
  if (!is_cut) a_W = limit_rate(a_W, chord);

  // Eq. (15): what a multirotor can do.
  const double size = std::sqrt(a_W.head<2>().squaredNorm());
  if (size > g) a_W.head<2>() *= g / size;
  a_W.z() = std::clamp(a_W.z(), -g, g);
  return vehicle_.quad_mass * (a_W - Vector3d(0.0, 0.0, g));  // eq. (16)
}

}  // namespace sls::control
