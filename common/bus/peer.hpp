#pragma once

#include <array>
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
/// In the order of the bytes. Sets and maps compare ids all the time, so two numbers are compared:
/// the compiler would call memcmp for the array.
inline bool operator<(const PeerId& a, const PeerId& b) {
  const auto head = [](const PeerId& id) {
    std::uint64_t number;
    std::memcpy(&number, id.bytes.data(), sizeof number);
    return __builtin_bswap64(number);
  };
  const auto tail = [](const PeerId& id) {
    std::uint32_t number;
    std::memcpy(&number, id.bytes.data() + sizeof(std::uint64_t), sizeof number);
    return __builtin_bswap32(number);
  };
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
  const std::uint64_t head_a = head(a), head_b = head(b);
  return head_a != head_b ? head_a < head_b : tail(a) < tail(b);
}

}  // namespace sls::bus
