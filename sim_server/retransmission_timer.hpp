#pragma once

#include <chrono>

namespace sls::sim {

/// When to send a state again because no answer came: four times the smoothed round trip, doubling
/// with every resend up to 100 ms. Karn's rules: only unambiguous round trips count, of a step that
/// was sent once; and until there is one the doubled time stays in force for the steps that follow,
/// or a link that has become slower than the timeout would never be measured again.
///
/// On a link that loses much, the second rule alone would double without end: at 20 % each way more
/// than a third of the steps are ambiguous. So an answer that comes early after the last resend,
/// within the undoubled timeout or a quarter of the doubled one, is treated as that resend's, and
/// ends the doubling; for a few steps in a row at most, because on a slower link it may be a
/// coincidence that repeats itself.
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

  /// The answer to a step came `since_first` after the state was first sent, and `since_last` after
  /// it was last sent.
  void answered(Duration since_first, Duration since_last);

  /// The state was sent again.
  void resent();

 private:
  static constexpr int kMostGuesses = 4;

  Duration calc_undoubled() const;

  Duration smoothed_{0};
  int resends_ = 0;            // since the doubling last ended
  int guesses_ = 0;            // ambiguous answers in a row that ended the doubling
  bool is_ambiguous_ = false;  // the current step was sent more than once
};

}  // namespace sls::sim
