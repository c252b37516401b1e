// No autopilot: the thrust has the direction of the force, without lag. README.md beside this file.
#include "sim_server/autopilots/autopilot.hpp"

namespace sls::sim {
namespace {

class None : public Autopilot {
 public:
  explicit None(const AutopilotSetup& setup) : rotors_(setup.airframe.rotors) {
    output_.direction_W = -Eigen::Vector3d::UnitZ();
  }

  const AutopilotOutput& step(const AutopilotInput& input) override {
    output_.thrust = input.f_Q_W.norm();
    output_.rotor_speeds = calc_equal_speeds(rotors_, output_.thrust);
    if (output_.thrust > 0.0) {
      output_.direction_W = input.f_Q_W / output_.thrust;
      output_.q_WB = calc_attitude_for(input.f_Q_W);
    }
    return output_;
  }

 private:
  const std::vector<Rotor> rotors_;
  AutopilotOutput output_;
};

}  // namespace

std::unique_ptr<Autopilot> make_none(const AutopilotSetup& setup) {
  return std::make_unique<None>(setup);
}

}  // namespace sls::sim
