#include "common/config/own_keys.hpp"

namespace sls::sim {
namespace {

struct NoneKeys {};

template <class Map>
void describe_own(Map&, config::Autopilot&, NoneKeys&) {}

}  // namespace

const config::ModelKeys<config::Autopilot>& none_keys() {
  static const config::OwnKeys<config::Autopilot, NoneKeys> keys;
  return keys;
}

}  // namespace sls::sim
