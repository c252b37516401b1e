/// The share of a topic's samples that a reader takes.
#pragma once

#include <chrono>
#include <cstdint>

namespace sls::bus {

/// Of the samples that a writer writes within `window`, the first `most`. A reader with a share
/// does not get the others, and the writer does not send them (fastdds/thinning.hpp).
struct Share {
  std::uint32_t most = 0;  ///< 0: a reader without a share, which stays so
  std::chrono::milliseconds window{0};

  friend bool operator==(const Share& a, const Share& b) {
    return a.most == b.most && a.window == b.window;
  }
};

/// All samples, but another share can follow.
inline constexpr Share kWholeShare{1'000, std::chrono::milliseconds(1)};

}  // namespace sls::bus
