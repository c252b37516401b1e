#pragma once

#include <optional>
#include <string>

#include "sim_server/core/participants/gathering.hpp"
#include "sim_server/core/participants/surroundings.hpp"
#include "sim_server/core/run_parts.hpp"

namespace sls::sim {

/// The time before step 0: the claim on the vehicles, then the wait for the participants. Rules:
/// docs/synchronisation.md, "Identity: one server per vehicle" and "Waiting for participants".
class Preparation {
 public:
  /// Begins with the claim at `now`.
  Preparation(RunParts& run, sync::Time now) : run_(run), began_(now) {}

  bool is_claimed() const { return gathering_.has_value(); }
  /// Looks whether the claim is settled; then the gathering begins.
  /// @throws std::runtime_error if another server has the better claim.
  void claim(const Surroundings& around, sync::Time now);
  void start_gathering(sync::Time now);
  /// True once the expected participants are ready.
  /// @throws std::runtime_error if they were waited for too long.
  bool gather(const Surroundings& around, sync::Time now);

  /// @throws std::runtime_error if another server has the better claim to one of the vehicles.
  void check_claim(const Surroundings& around) const;

 private:
  RunParts& run_;
  sync::Time began_;  // to listen
  std::optional<Gathering> gathering_;
};

}  // namespace sls::sim
