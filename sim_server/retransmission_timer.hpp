#pragma once

#include <chrono>

namespace sls::sim {

/// When to send a state again because no answer came: four times the smoothed round trip, doubling
/// with every resend of the same step up to 100 ms. Only unambiguous round trips count (a step that
/// was sent once: Karn's rule).
class RetransmissionTimer {
 public:
  using Duration = std::chrono::nanoseconds;

  /// A resend sooner than this would mostly repeat what a busy machine is about to answer.
  static constexpr Duration kShortest = std::chrono::milliseconds(1);
  static constexpr Duration kLongest = std::chrono::milliseconds(100);
  /// Before the first round trip is known.
  static constexpr Duration kInitial = std::chrono::milliseconds(20);

  /// Time to wait for the answer before the state is sent again.
  Duration timeout() const;

  /// The answer to a step came `round_trip` after the state was first sent.
  void answered(Duration round_trip);

  /// The state was sent again.
  void resent();

 private:
  Duration smoothed_{0};
  int resends_ = 0;  // of the current step
};

}  // namespace sls::sim
