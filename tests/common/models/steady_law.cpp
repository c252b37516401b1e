// A law as a folder of control_client/laws/ defines it (docs/adding-a-model.md).
#include "common/config/own_keys.hpp"
#include "control_client/laws/control_law.hpp"

namespace sls::control {
namespace {

struct SteadyKeys {
  double share = 1.0;  ///< of the weight
};

template <class Map>
void describe_own(Map& map, config::Controller&, SteadyKeys& keys) {
  map.key(config::kOptional, "share", keys.share, config::kPositive);
}

class SteadyLaw : public ControlLaw {
 public:
  explicit SteadyLaw(double force) : force_(force) {}
  LawOutput calc(const LawInput&) const override {
    LawOutput output;
    output.f_Q_W.z() = -force_;
    return output;
  }

 private:
  double force_;  ///< N, upwards
};

}  // namespace

const config::ModelKeys<config::Controller>& steady_keys() {
  static const config::OwnKeys<config::Controller, SteadyKeys> keys;
  return keys;
}

std::unique_ptr<const ControlLaw> make_steady_law(const LawSetup& setup) {
  const model::SlungLoadParameters& vehicle = setup.controller.model.vehicle;
  return std::make_unique<SteadyLaw>(setup.controller.own.get<SteadyKeys>().share *
                                     vehicle.total_mass() * vehicle.gravity);
}

}  // namespace sls::control
