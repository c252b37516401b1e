/// Facts that node.cpp and shared_locks.cpp share. No Fast DDS here.
#pragma once

#include <atomic>

namespace sls::bus {

/// True in programs that link sls::shared_locks. In others a reader that is stopped inside a lock
/// would stop the writer, and one that is killed there would end it.
inline bool can_share_data = false;

/// True once this process closes its participant. Nothing reads its ports of shared memory any
/// more, so a stopped process that holds a lock of such a port must not block the exit
/// (shared_locks.cpp).
inline std::atomic<bool> is_leaving{false};

}  // namespace sls::bus
