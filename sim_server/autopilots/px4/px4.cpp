// The attitude stack of PX4: attitude, rates, mixer. README.md beside this file.
#include <optional>
#include <stdexcept>

#include "sim_server/autopilots/autopilot.hpp"
#include "sim_server/autopilots/px4/keys.hpp"
#include "sim_server/autopilots/rotor_wrenches.hpp"

namespace sls::sim {
namespace px4 {
namespace {

std::vector<MixerRow> choose_mixer(const AutopilotSetup& setup, const Keys& keys) {
  if (!keys.mixer) return make_mixer(setup);
  const std::size_t rotors = setup.airframe.rotors.size();
  if (keys.mixer->size() != rotors)
    throw make_setup_error(setup, "autopilot.mixer",
                           "expected a row for each of the " + std::to_string(rotors) +
                               " rotors, got " + std::to_string(keys.mixer->size()));
  return *keys.mixer;
}

class Px4 : public Autopilot {
 public:
  explicit Px4(const AutopilotSetup& setup)
      : keys_(setup.autopilot.own.get<Keys>()),
        mixer_(choose_mixer(setup, keys_)),
        rate_control_(keys_.rates, 1e-9 * static_cast<double>(setup.autopilot.period_ns)) {
    if (keys_.thrust_map != ThrustMap::kExact) return;
    try {
      exact_thrust_.emplace(setup.airframe.rotors, mixer_, keys_.speeds);
    } catch (const std::invalid_argument& error) {
      throw make_setup_error(setup, "autopilot.thrust_map", error.what());
    }
  }

  const AutopilotOutput& step(const AutopilotInput& input) override {
    output_.thrust = input.f_Q_W.norm();
    // A zero force has no direction: the previous attitude set-point stays.
    if (output_.thrust > 0.0) output_.q_WB = calc_attitude_for(input.f_Q_W);
    const Eigen::Vector3d rate_set_points =
        calc_rate_set_points(input.attitude.q_WB, output_.q_WB, keys_.attitude);
    const Eigen::Vector3d torque =
        rate_control_.step(input.attitude.w_WB_B, rate_set_points, saturation_);
    const MixerOutput mixed = mix(mixer_, torque, calc_thrust(output_.thrust));
    saturation_ = mixed.saturation;
    // Eq. (14).
    output_.rotor_speeds =
        (keys_.speeds.speed_per_output * mixed.outputs).array() + keys_.speeds.speed_at_zero;
    return output_;
  }

 private:
  double calc_thrust(double force) const {
    return exact_thrust_ ? exact_thrust_->calc_thrust(force)
                         : calc_affine_thrust(keys_.affine_thrust.value_or(AffineThrust{}), force);
  }

  const Keys keys_;
  const std::vector<MixerRow> mixer_;
  std::optional<ExactThrust> exact_thrust_;
  RateControl rate_control_;
  Saturation saturation_;  // of the last step
  AutopilotOutput output_;
};

}  // namespace
}  // namespace px4

std::unique_ptr<Autopilot> make_px4(const AutopilotSetup& setup) {
  return std::make_unique<px4::Px4>(setup);
}

}  // namespace sls::sim
