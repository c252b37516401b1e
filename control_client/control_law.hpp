/// What a control law is. A new one implements `ControlLaw` and gets a line in `make_control_law`.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "common/config/scenario.hpp"
#include "common/model/reference.hpp"
#include "common/model/state.hpp"
#include "control_client/flight_controller.hpp"

namespace sls::control {

/// All that a law may look at.
struct LawInput {
  Eigen::Vector3d p_WQ = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d v_WQ = Eigen::Vector3d::Zero();  ///< m/s
  model::RodAngles rod;                            ///< as wired to the controller's slots
  model::Reference reference;
  Eigen::Vector3d integral = Eigen::Vector3d::Zero();  ///< ∫e dt, m·s
};

struct LawOutput {
  Eigen::Vector3d f_Q_W = Eigen::Vector3d::Zero();          ///< N; zero with a fault
  Eigen::Vector3d load_error = Eigen::Vector3d::Zero();     ///< e = y − y_r as the law sees it, m
  Eigen::Vector3d integral_rate = Eigen::Vector3d::Zero();  ///< e where e is integrated, else 0, m
  Fault fault = Fault::kNone;
};

/// A pure function from input to output.
class ControlLaw {
 public:
  virtual ~ControlLaw() = default;
  virtual LawOutput calc(const LawInput& input) const = 0;
};

/// The law that `controller.law` names, with the gains and the model `controller` gives it.
/// @throws config::ConfigError for an unknown name or weights without a solution.
std::unique_ptr<const ControlLaw> make_control_law(const config::Controller& controller);

}  // namespace sls::control
