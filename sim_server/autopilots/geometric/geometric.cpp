// Geometric tracking of the attitude on SE(3). README.md beside this file.
#include <algorithm>
#include <cmath>

#include "common/model/dot.hpp"
#include "sim_server/autopilots/autopilot.hpp"
#include "sim_server/autopilots/geometric/allocation.hpp"
#include "sim_server/autopilots/geometric/attitude_tracking.hpp"
#include "sim_server/autopilots/geometric/keys.hpp"

namespace sls::sim {
namespace geometric {
namespace {

Gains choose_gains(const AutopilotSetup& setup) {
  const auto& keys = setup.autopilot.own.get<Keys>();
  const Gains usual = make_default_gains(setup.airframe.inertia_C_B);
  return {keys.attitude.value_or(usual.attitude), keys.rate.value_or(usual.rate)};
}

class Geometric : public Autopilot {
 public:
  explicit Geometric(const AutopilotSetup& setup)
      : airframe_(setup.airframe), gains_(choose_gains(setup)), allocation_(setup) {}

  const AutopilotOutput& step(const AutopilotInput& input) override {
    // A zero force has no direction: the previous attitude set-point stays.
    if (!input.f_Q_W.isZero(0.0)) output_.q_WB = calc_attitude_for(input.f_Q_W);
    const Rotation rotation{input.attitude.q_WB.toRotationMatrix(), input.attitude.w_WB_B};
    WantedRotation wanted;  // held until the next step, therefore its rate is 0
    wanted.R_WB = output_.q_WB.toRotationMatrix();
    const Eigen::Vector3d moment = calc_moment(rotation, wanted, airframe_.inertia_C_B, gains_);
    // Eq. (7). Rotors do not push down.
    output_.thrust = std::max(0.0, -model::dot(input.f_Q_W, rotation.R_WB.col(2)));
    output_.rotor_speeds = allocation_.calc_thrusts(moment, output_.thrust);
    for (std::size_t i = 0; i < airframe_.rotors.size(); ++i) {
      double& number = output_.rotor_speeds[static_cast<Eigen::Index>(i)];
      number = std::sqrt(number / airframe_.rotors[i].thrust_constant);
    }
    return output_;
  }

 private:
  const Airframe airframe_;
  const Gains gains_;
  const Allocation allocation_;
  AutopilotOutput output_;
};

}  // namespace
}  // namespace geometric

std::unique_ptr<Autopilot> make_geometric(const AutopilotSetup& setup) {
  return std::make_unique<geometric::Geometric>(setup);
}

}  // namespace sls::sim
