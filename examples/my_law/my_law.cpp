// Your own control law in C++, flown in one process without DDS.
#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>

#include "closed_loop/flight.hpp"
#include "common/config/scenario.hpp"
#include "control_client/laws/control_law.hpp"

namespace {

using namespace sls;
using Eigen::Vector3d;

/// Controls the load position by the slope of the rod, for small angles.
class MyLaw : public control::ControlLaw {
 public:
  explicit MyLaw(const model::SlungLoadParameters& vehicle) : vehicle_(vehicle) {}

  control::LawOutput calc(const control::LawInput& input) const override {
    const Vector3d rod = input.state.p_WL - input.state.p_WQ;
    const Vector3d rod_rate = input.state.v_WL - input.state.v_WQ;
    const Vector3d wanted =  // acceleration of the load
        1.5 * (0.8 * (input.reference.position - input.state.p_WL) - input.state.v_WL);
    control::LawOutput output;
    if (rod.z() < 0.1 * vehicle_.rod_length) {
      output.error_code = control::ErrorCode::kRodLevel;
      return output;
    }
    const double support = vehicle_.gravity - wanted.z();
    const Vector3d slope = rod / rod.z(), wanted_slope = -wanted / support;
    const Vector3d turn = 36.0 * (wanted_slope - slope) - 12.0 * rod_rate / rod.z();
    output.f_Q_W =
        -vehicle_.total_mass() * support * slope - vehicle_.quad_mass * vehicle_.rod_length * turn;
    output.f_Q_W.z() = -vehicle_.total_mass() * support;
    return output;
  }

 private:
  const model::SlungLoadParameters vehicle_;
};

void fly(const char* scenario_file) {
  closed_loop::FlightOptions options;
  options.make_law = [](const control::LawSetup& setup) {
    return std::make_unique<MyLaw>(setup.controller.model.vehicle);
  };
  closed_loop::Flight flight(config::load_scenario(scenario_file), {0}, options);
  double sum = 0.0, error = 0.0;
  std::size_t steps = 0;
  for (; const model::StepRecord* step = flight.fly_step(); ++steps) {
    error = (step->truth.p_WL - step->answer.reference.position).norm();
    sum += error * error;
  }
  if (!flight.failure().empty()) throw std::runtime_error(flight.failure());
  std::printf("%zu steps, load position error: rms %.4f m, at the end %.4f m\n", steps,
              std::sqrt(sum / static_cast<double>(steps)), error);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    fly(argc > 1 ? argv[1] : "my_law.yaml");
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "my_law: error: %s\n", error.what());
    return 1;
  }
}
