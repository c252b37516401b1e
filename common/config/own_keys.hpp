/// How the folder of a plant, an autopilot or a law describes its own keys:
///
///     struct PidKeys { … };                                     // keys.hpp: values with defaults
///     template <class Map>
///     void describe_own(Map& map, config::Controller&, PidKeys& keys) {
///       map.key(config::kOptional, "gains", keys.gains);        // as in scenario_keys.hpp
///     }
///     const config::OwnKeys<config::Controller, PidKeys> kKeys;  // keys.cpp, for the registry
#pragma once

#include "common/config/key_lister.hpp"
#include "common/config/model_keys.hpp"
#include "common/config/scenario_reader.hpp"
#include "common/config/scenario_writer.hpp"

namespace sls::config {

template <class Section, class Own>
class OwnKeys : public ModelKeys<Section> {
 public:
  void describe(KeyLister& map, Section& section) const override { describe_with(map, section); }
  void describe(KeyNames& map, Section& section) const override { describe_with(map, section); }
  void describe(MapReader& map, Section& section) const override { describe_with(map, section); }
  void describe(MapWriter& map, Section& section) const override { describe_with(map, section); }

 private:
  template <class Map>
  static void describe_with(Map& map, Section& section) {
    describe_own(map, section, section.own.template edit<Own>());
  }
};

/// The keys of every shared library: `parameters`, which only the library itself understands.
template <class Map, class Section>
void describe_own(Map& map, Section&, LibraryParameters& parameters) {
  map.key(kOptional, "parameters", parameters);
}

/// The keys of an autopilot in a shared library: also its period.
template <class Map>
void describe_own(Map& map, Autopilot& autopilot, LibraryParameters& parameters) {
  describe_period(map, autopilot);
  map.key(kOptional, "parameters", parameters);
}

}  // namespace sls::config
