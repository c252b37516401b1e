/// Tells whether this program links shared_locks.cpp. No Fast DDS here.
#pragma once

namespace sls::bus {

/// True in programs that link sls::shared_locks. In others a reader that is stopped inside a lock
/// would stop the writer, and one that is killed there would end it.
inline bool can_share_data = false;

}  // namespace sls::bus
