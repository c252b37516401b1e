/// How long a server listens for other claims before its vehicles are its own.
#pragma once

#include <chrono>

namespace sls::sim {

inline constexpr auto kClaimTime = std::chrono::seconds(1);
/// On one machine, where programs discover each other within milliseconds and no packet is lost.
inline constexpr auto kLocalClaimTime = std::chrono::milliseconds(250);

/// True if a server that has listened for `listened` need not listen longer. `is_on_this_machine`:
/// its QoS file restricts it to this machine. `has_heard_every_claim`: of the servers there.
inline bool is_claim_settled(std::chrono::steady_clock::duration listened, bool is_on_this_machine,
                             bool has_heard_every_claim) {
  return listened >= kClaimTime ||
         (listened >= kLocalClaimTime && is_on_this_machine && has_heard_every_claim);
}

}  // namespace sls::sim
