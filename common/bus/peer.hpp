#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace sls::bus {

/// Identifies one DDS participant of the domain, here or on another machine, for its lifetime (the
/// prefix of its GUID). Two programs never share one.
struct PeerId {
  std::array<std::uint8_t, 12> bytes{};
};

inline bool operator==(const PeerId& a, const PeerId& b) { return a.bytes == b.bytes; }
inline bool operator!=(const PeerId& a, const PeerId& b) { return !(a == b); }
/// In the order of the bytes. Sets and maps compare ids all the time, so numbers are compared: the
/// compiler would call memcmp for the array.
inline bool operator<(const PeerId& a, const PeerId& b) {
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
  const auto load = [](const PeerId& id, std::size_t first) {
    std::uint64_t number;
    std::memcpy(&number, id.bytes.data() + first, sizeof number);
    return __builtin_bswap64(number);
  };
  const std::uint64_t head_a = load(a, 0), head_b = load(b, 0);
  return head_a != head_b ? head_a < head_b : load(a, 4) < load(b, 4);  // bytes 4 to 7 are equal
}

}  // namespace sls::bus
