#pragma once

#include <cstdint>

namespace sls::worlds {

inline constexpr std::uint64_t kEmptyHash = 0xcbf29ce484222325u;

/// Adds a number to a hash (FNV-1a over 64-bit words, with one more shift).
inline void mix(std::uint64_t& hash, std::uint64_t value) {
  hash = (hash ^ value) * 0x100000001b3u;
  hash ^= hash >> 29;
}

}  // namespace sls::worlds
