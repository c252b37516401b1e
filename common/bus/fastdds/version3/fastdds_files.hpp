/// Files of Fast DDS 3; version2/ has the same for Fast DDS 2. No Fast DDS here.
#pragma once

namespace sls::bus {

inline constexpr int kFastDdsMajor = 3;

/// Beginning of the names of its files in /dev/shm: PREFIXportN of a port, PREFIX and sixteen
/// hexadecimal digits of a participant's segment.
inline constexpr const char* kSharedMemoryPrefix = "fastdds_";

}  // namespace sls::bus
