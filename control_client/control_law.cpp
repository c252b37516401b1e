#include "control_client/control_law.hpp"

#include "control_client/lqr.hpp"
#include "control_client/qsf_law.hpp"

namespace sls::control {

std::unique_ptr<const ControlLaw> make_control_law(const config::Controller& controller) {
  if (controller.law == "qsf") {
    return std::make_unique<QsfLaw>(controller.model.vehicle, make_named_gains(controller.gains));
  }
  throw config::ConfigError("controller.law: expected qsf, got " + controller.law);
}

}  // namespace sls::control
