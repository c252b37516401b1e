#include "control_client/laws/cooperative/keys.hpp"

#include "common/config/own_keys.hpp"
#include "control_client/laws/cooperative/distribution.hpp"

namespace sls::control {
namespace {

class CooperativeOwnKeys : public config::OwnKeys<config::Controller, CooperativeKeys> {
  void check(const config::Scenario& scenario, const config::Places& places) const override {
    if (!scenario.shared_load)
      throw places.make_error_at("controller.law",
                                 "'cooperative' is for vehicles that carry one load "
                                 "(plant.model 'cables'), here it is '" +
                                     scenario.plant.model.name + "'");
    const model::SharedLoad& load = *scenario.shared_load;
    if (load.inertia_L && !can_turn(load))
      throw places.make_error_at("controller.law",
                                 "'cooperative' turns a rigid load by three or more cables whose "
                                 "attachments are not on one line; cables that end on a line "
                                 "cannot turn it about that line");
    if (!load.inertia_L && load.cables.size() > 1 &&
        scenario.controller.own.get<CooperativeKeys>().spread == 0.0)
      throw places.make_error_at(
          "controller.spread_rad",
          "expected > 0 where several cables end at one point, because their "
          "vehicles would hover at one place, got 0");
    if (scenario.plant.initial.placed != config::Body::kLoad)
      throw places.make_error_at(
          "plant.initial.quad_position_m",
          "expected load_position_m with law 'cooperative', whose references "
          "are those of the load");
  }
};

}  // namespace

const config::ModelKeys<config::Controller>& cooperative_keys() {
  static const CooperativeOwnKeys keys;
  return keys;
}

}  // namespace sls::control
