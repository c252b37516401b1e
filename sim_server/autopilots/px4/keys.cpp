#include "sim_server/autopilots/px4/keys.hpp"

#include <algorithm>

#include "common/config/own_keys.hpp"

namespace sls::sim {
namespace {

using config::to_text;

class Px4Keys : public config::OwnKeys<config::Autopilot, px4::Keys> {
 public:
  void check(const config::Scenario& scenario, const config::Places& places) const override {
    const config::Autopilot& autopilot = *scenario.autopilot;
    const auto& keys = autopilot.own.get<px4::Keys>();
    if (keys.affine_thrust && keys.thrust_map != px4::ThrustMap::kAffine)
      throw places.make_error_at("autopilot.affine_thrust",
                                 "of thrust_map 'affine', here it is 'exact'");
    check_cut_off("rate_cut_off_hz", keys.rates.rate_cut_off, autopilot, places);
    check_cut_off("derivative_cut_off_hz", keys.rates.derivative_cut_off, autopilot, places);
    const auto lifts = [](const px4::MixerRow& row) { return row.thrust > 0.0; };
    if (keys.mixer && std::none_of(keys.mixer->begin(), keys.mixer->end(), lifts))
      throw places.make_error_at("autopilot.mixer",
                                 "expected thrust > 0 in at least one row, got 0 in all");
  }

 private:
  static void check_cut_off(const char* key, double cut_off, const config::Autopilot& autopilot,
                            const config::Places& places) {
    const double most = 0.5e9 / static_cast<double>(autopilot.period_ns);
    if (!(cut_off < most))
      throw places.make_error_at(
          std::string("autopilot.rates.") + key,
          "expected 0 (no filter) or less than half the rate of the autopilot (" + to_text(most) +
              "), got " + to_text(cut_off));
  }
};

}  // namespace

const config::ModelKeys<config::Autopilot>& px4_keys() {
  static const Px4Keys keys;
  return keys;
}

}  // namespace sls::sim
