#include "control_client/state_wiring.hpp"

#include "common/model/math.hpp"

namespace sls::control {

model::RodAngles calc_wired_angles(const model::RodAngles& rod, config::StateWiring wiring,
                                   double rod_length) {
  if (wiring == config::StateWiring::kCorrect) return rod;
  // Eq. (14): angles exchanged, one sign wrong, velocities of the load instead of rates.
  model::RodAngles slots;
  slots.alpha = rod.beta;
  slots.beta = -rod.alpha;
  slots.alpha_dot = rod_length * rod.alpha_dot -
                    2.0 * rod_length * math::tan(rod.alpha) * math::tan(rod.beta) * rod.beta_dot;
  slots.beta_dot = rod_length * rod.beta_dot;
  return slots;
}

}  // namespace sls::control
