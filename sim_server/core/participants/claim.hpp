/// How long a server listens before its vehicles are its own, and which of two servers keeps a
/// vehicle. Rules: docs/synchronisation.md, "Identity: one server per vehicle".
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "common/sync/servers.hpp"

namespace sls::sim {

inline constexpr auto kClaimTime = std::chrono::seconds(1);
/// On one machine, where programs discover each other within milliseconds and no packet is lost.
inline constexpr auto kLocalClaimTime = std::chrono::milliseconds(250);

/// True if a server that has listened for `listened` need not listen longer. `is_on_this_machine`:
/// its QoS file restricts it to this machine. `has_heard_every_claim`: of the servers there.
inline bool is_claim_settled(sync::Duration listened, bool is_on_this_machine,
                             bool has_heard_every_claim) {
  return listened >= kClaimTime ||
         (listened >= kLocalClaimTime && is_on_this_machine && has_heard_every_claim);
}

/// The error of a server that has lost one of `vehicle_ids` to another: to one of `others` that is
/// further than its own run `run_id`, or as far with a lower run id. Empty if there is none.
/// `progress`: sync::calc_progress of the own run.
std::string describe_rival(const std::vector<sync::Run>& others, std::uint64_t run_id,
                           const std::vector<std::uint32_t>& vehicle_ids, int progress);

}  // namespace sls::sim
