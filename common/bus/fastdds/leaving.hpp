/// Whether this process is closing its participant.
#pragma once

#include <atomic>

namespace sls::bus {

/// True from then on: nothing reads this process's ports of shared memory any more, and a stopped
/// process that holds a lock of one must not keep this one from ending (shared_locks.cpp).
inline std::atomic<bool> is_leaving{false};

}  // namespace sls::bus
