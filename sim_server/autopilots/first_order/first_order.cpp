// The direction of the thrust follows that of the force with a first-order lag. README.md beside
// this file.
#include "common/model/math.hpp"
#include "sim_server/autopilots/autopilot.hpp"
#include "sim_server/autopilots/first_order/keys.hpp"

namespace sls::sim {
namespace {

class FirstOrder : public Autopilot {
 public:
  explicit FirstOrder(const AutopilotSetup& setup)
      : rotors_(setup.airframe.rotors),
        kept_(calc_kept(1e-9 * static_cast<double>(setup.autopilot.period_ns),
                        setup.autopilot.own.get<FirstOrderKeys>().lag_s)) {
    output_.direction_W = -Eigen::Vector3d::UnitZ();
  }

  const AutopilotOutput& step(const AutopilotInput& input) override {
    output_.thrust = input.f_Q_W.norm();
    output_.rotor_speeds = calc_equal_speeds(rotors_, output_.thrust);
    if (output_.thrust == 0.0) return output_;
    output_.q_WB = calc_attitude_for(input.f_Q_W);
    const Eigen::Vector3d wanted = input.f_Q_W / output_.thrust;
    Eigen::Vector3d& direction = *output_.direction_W;
    const Eigen::Vector3d next = wanted + kept_ * (direction - wanted);
    // `next` can vanish on the way to the opposite direction; then the direction stays.
    if (next.norm() > 0.0) direction = next.normalized();
    return output_;
  }

 private:
  /// The fraction of a deviation that remains after one period.
  static double calc_kept(double period_s, double lag_s) {
    return lag_s > 0.0 ? math::exp(-period_s / lag_s) : 0.0;
  }

  const std::vector<Rotor> rotors_;
  const double kept_;
  AutopilotOutput output_;
};

}  // namespace

std::unique_ptr<Autopilot> make_first_order(const AutopilotSetup& setup) {
  return std::make_unique<FirstOrder>(setup);
}

}  // namespace sls::sim
