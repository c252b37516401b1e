/// Whether this process may use processor time to hear of a message sooner.
#pragma once

#include <atomic>

namespace sls::bus {

/// True: a thread that waits for a message looks for it for up to 0.1 ms before it sleeps
/// (fastdds/adaptive_spin.hpp). Only in programs that link sls::shared_locks.
inline std::atomic<bool> is_spinning{false};

/// To be called by a program whose next message usually comes at once: in lockstep, by the server
/// and by the controllers. Does nothing if the process may use one processor only, which
/// spinning would keep from the sender, or where the environment has SLS_SPIN=off.
void start_spinning();
void stop_spinning();

}  // namespace sls::bus
