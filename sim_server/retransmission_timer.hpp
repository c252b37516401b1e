#pragma once

#include <chrono>

namespace sls::sim {

/// When to send a state again because no answer came: four times the smoothed round trip, doubling
/// with every resend up to 100 ms. Karn's rules: only unambiguous round trips count, of a step that
/// was sent once; and until there is one the doubled time stays in force for the steps that follow,
/// or a link that has become slower than the timeout would never be measured again.
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
  int resends_ = 0;            // since the last unambiguous round trip
  bool is_ambiguous_ = false;  // the current step was sent more than once
};

}  // namespace sls::sim
