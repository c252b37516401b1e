/// Switches polling for messages on and off. It receives a message sooner, but takes processor
/// time.
#pragma once

#include <sched.h>
#include <atomic>
#include <cstdlib>
#include <string_view>

namespace sls::bus {

/// True: a thread that waits for a message polls for up to 0.1 ms before it sleeps
/// (fastdds/adaptive_spin.hpp). Only in programs that link sls::shared_locks.
inline std::atomic<bool> is_spinning{false};

/// For programs whose next message usually comes at once: the server and the controllers in
/// lockstep. Does not start if the process may use only one processor, because polling would keep
/// it from the sender, or if the environment has SLS_SPIN=off.
inline void start_spinning() {
  cpu_set_t allowed;
  const char* value = std::getenv("SLS_SPIN");
  is_spinning = sched_getaffinity(0, sizeof(allowed), &allowed) == 0 && CPU_COUNT(&allowed) > 1 &&
                !(value && std::string_view(value) == "off");
}
inline void stop_spinning() { is_spinning = false; }

}  // namespace sls::bus
