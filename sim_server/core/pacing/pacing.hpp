#pragma once

#include "sim_server/core/answers/command_sample.hpp"
#include "sim_server/core/participants/surroundings.hpp"
#include "sim_server/core/step/vehicle.hpp"

namespace sls::sim {

/// When the states of a step are due, and when the step is over: lockstep or real time. In each
/// step the core asks `due`, publishes, calls `published`, and then `close` until the step is over.
class Pacing {
 public:
  virtual ~Pacing() = default;

  /// Step 0 is about to be published.
  virtual void begin(sync::Time now) = 0;
  /// When the states of the step in work may be published.
  virtual sync::Time due() const = 0;
  /// They were published.
  virtual void published(const Moment& moment) = 0;
  /// True if the step in work is over: then every vehicle has its outcome. Sends states again,
  /// passes over silent controllers and flies without answers, as the rules say.
  /// @throws std::runtime_error if the run cannot go on.
  virtual bool close(sync::Time now) = 0;
  /// When `close` must be called even if no answer comes.
  virtual sync::Time deadline() const = 0;

  /// A sample was judged.
  virtual void received(const CommandSample&) {}
  /// A valid answer came to an earlier step.
  virtual void note_late(Vehicle&, const OfferedAnswer&, sync::Time) {}
  /// The roster was refreshed.
  virtual void roster_changed(sync::Time) {}
  /// Looks at the state of the network, a few times a second.
  virtual void look(const Surroundings&) {}
  /// The run was at rest between two steps.
  virtual void note_rest(sync::Duration) {}
};

}  // namespace sls::sim
