#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "worlds/timeline.hpp"

namespace sls::worlds {

inline constexpr std::uint64_t kEmptyHash = 0xcbf29ce484222325u;

/// Adds a number to a hash (FNV-1a over 64-bit words, with one more shift).
inline void mix(std::uint64_t& hash, std::uint64_t value) {
  hash = (hash ^ value) * 0x100000001b3u;
  hash ^= hash >> 29;
}

/// All that happened in a world, as one number, and as lines if they are wanted.
class Trace {
 public:
  explicit Trace(bool keeps_lines) : keeps_lines_(keeps_lines) {}

  bool keeps_lines() const { return keeps_lines_; }
  /// `who` says or does `what`.
  void add(Instant now, std::string_view who, std::string_view what);
  /// Counts an event without a line.
  void add(std::uint64_t value) { mix(hash_, value); }
  std::uint64_t hash() const { return hash_; }
  const std::vector<std::string>& lines() const { return lines_; }

 private:
  void add(std::string_view text);

  const bool keeps_lines_;
  std::uint64_t hash_ = kEmptyHash;
  std::vector<std::string> lines_;
};

}  // namespace sls::worlds
