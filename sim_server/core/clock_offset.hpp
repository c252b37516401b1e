/// How far the clock of a client is ahead of ours, from its answers. No clock and no network here.
#pragma once

#include <chrono>
#include <optional>

namespace sls::sim {

class ClockOffset {
 public:
  using Time = std::chrono::system_clock::time_point;

  /// One state and its answer.
  struct Exchange {
    Time published;                      ///< the state, by our clock
    std::chrono::nanoseconds computing;  ///< for the answer, as the client reports it
    Time written;                        ///< the answer, by the client's clock
    Time arrived;                        ///< the answer, by our clock
  };
  void note(const Exchange& exchange);

  /// How far the client's clock is ahead of ours; negative if it is behind. Nothing before
  /// kLeastAnswers. Link delay has no effect if it is equal both ways; else half of the
  /// difference enters.
  std::optional<std::chrono::nanoseconds> offset() const;

  static constexpr int kLeastAnswers = 8;
  /// The shortest round trip of the last one to two such times counts, so a clock that was
  /// corrected is noticed.
  static constexpr std::chrono::seconds kMemory{2};

 private:
  struct Best {
    std::chrono::nanoseconds round_trip;
    std::chrono::nanoseconds offset;
  };
  static void keep_shorter(std::optional<Best>& best, const Best& other);

  int answers_ = 0;  // up to kLeastAnswers
  Time began_;       // when `current_` began
  std::optional<Best> current_, earlier_;
};

}  // namespace sls::sim
