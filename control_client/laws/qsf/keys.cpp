#include "control_client/laws/qsf/keys.hpp"

#include <cmath>

#include "common/config/numbers.hpp"
#include "common/config/own_keys.hpp"

namespace sls::control {
namespace {

class QsfOwnKeys : public config::OwnKeys<config::Controller, QsfKeys> {
  /// A small rate costs height: README.md, "Slack cables".
  std::optional<config::ConfigError> find_warning(const config::Scenario& scenario,
                                                  const config::Places& places) const override {
    constexpr double kUsual = 2.0;  // m/s
    const auto& rate = scenario.controller.own.get<QsfKeys>().retaut_rate;
    if (!scenario.shared_load || !rate || *rate >= kUsual) return {};
    const double g = scenario.vehicle.gravity;
    const double time = scenario.vehicle.rod_length / *rate + *rate / (2.0 * g);
    return places.make_error_at(
        "controller.retaut_rate_m_s",
        "expected at least 2, got " + config::to_text(*rate) +
            ": a load that falls by its whole cable is caught " +
            config::to_text(std::round(5.0 * g * time * time) / 10.0) + " m lower");
  }
};

}  // namespace

const config::ModelKeys<config::Controller>& qsf_keys() {
  static const QsfOwnKeys keys;
  return keys;
}

}  // namespace sls::control
