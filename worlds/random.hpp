#pragma once

#include <cstddef>
#include <cstdint>

namespace sls::worlds {

/// The generator of a world (splitmix64, Steele et al. 2014): equal on all machines, which the
/// distributions of the standard library are not.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t next() {
    std::uint64_t mixed = state_ += 0x9e3779b97f4a7c15u;
    mixed = (mixed ^ (mixed >> 30)) * 0xbf58476d1ce4e5b9u;
    mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebu;
    return mixed ^ (mixed >> 31);
  }
  /// In [0, 1).
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * uniform(); }
  /// In [low, high].
  std::int64_t integer(std::int64_t low, std::int64_t high) {
    return low + static_cast<std::int64_t>(next() % static_cast<std::uint64_t>(high - low + 1));
  }
  /// Below `count`, which is at least 1.
  std::size_t index(std::size_t count) {
    return static_cast<std::size_t>(integer(0, static_cast<std::int64_t>(count) - 1));
  }
  bool chance(double probability) { return probability > 0 && uniform() < probability; }
  /// A generator of its own, so that more draws here change nothing there.
  Random split() { return Random(next()); }

 private:
  std::uint64_t state_;
};

}  // namespace sls::worlds
