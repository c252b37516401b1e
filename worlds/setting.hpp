#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "worlds/network.hpp"
#include "worlds/properties.hpp"
#include "worlds/trace.hpp"

namespace sls::worlds {

/// A scenario that worlds fly, and its undisturbed flights in one process.
struct FlownScenario {
  using VehicleIds = std::vector<std::uint32_t>;
  config::Scenario scenario;
  /// Of the flights of all vehicles, of the first one, and of the others.
  std::map<VehicleIds, std::string> certificates;
  std::uint64_t last_step = 0;  ///< of the flight of all vehicles
  std::string failure;          ///< why it failed; empty: every mission was finished
  bool is_refused = false;      ///< it failed by an answer, else by a plant
};

/// All that the programs of a world share. The world owns it.
struct Setting {
  Setting(std::uint64_t world_seed, bool keeps_lines)
      : seed(world_seed),
        random(Random(~world_seed).next()),
        trace(keeps_lines),
        network(timeline, random.split()),
        properties(timeline, trace) {}

  const std::uint64_t seed;
  Random random;
  Timeline timeline;
  Trace trace;
  Network network;
  const FlownScenario* flown = nullptr;
  std::string folder;  ///< of its files; it is in no line of the trace
  bool is_one_machine = false;
  Properties properties;
  /// Called when a server publishes a step for the first time.
  std::function<void(std::uint64_t step)> on_step;
  /// True if all programs have ended except foreign ones.
  std::function<bool()> are_all_others_done;
};

}  // namespace sls::worlds
