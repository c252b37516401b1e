#pragma once

#include <array>
#include <cstdint>

namespace sls::bus {

/// Identifies one DDS participant of the domain, here or on another machine, for its lifetime (the
/// prefix of its GUID). Two programs never share one.
struct PeerId {
  std::array<std::uint8_t, 12> bytes{};
};

inline bool operator==(const PeerId& a, const PeerId& b) { return a.bytes == b.bytes; }
inline bool operator!=(const PeerId& a, const PeerId& b) { return !(a == b); }
inline bool operator<(const PeerId& a, const PeerId& b) { return a.bytes < b.bytes; }

}  // namespace sls::bus
