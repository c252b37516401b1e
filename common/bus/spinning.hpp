/// Switches polling for messages on and off. It receives a message sooner, but takes processor
/// time.
#pragma once

#include <atomic>

namespace sls::bus {

/// True: a thread that waits for a message polls for up to 0.1 ms before it sleeps
/// (fastdds/adaptive_spin.hpp). Only in programs that link sls::shared_locks.
inline std::atomic<bool> is_spinning{false};

/// For programs whose next message usually comes at once: the server and the controllers in
/// lockstep. Does not start if the process may use only one processor, because polling would keep
/// it from the sender, or if the environment has SLS_SPIN=off.
void start_spinning();
void stop_spinning();

}  // namespace sls::bus
