/// Whether this process is closing its participant.
#pragma once

#include <atomic>

namespace sls::bus {

/// True from that time on. Nothing reads this process's ports of shared memory any more, so a
/// stopped process that holds a lock of such a port must not block the exit (shared_locks.cpp).
inline std::atomic<bool> is_leaving{false};

}  // namespace sls::bus
