#pragma once

#include <chrono>

namespace sls::sim {

/// Time after which a state is sent again because no answer came: four times the smoothed round
/// trip, doubled with every resend up to 100 ms. Karn's rules: only unambiguous round trips count,
/// those of a step that was sent once. Until there is one, the doubled time stays in force for the
/// next steps; otherwise a link that has become slower than the timeout would never be measured
/// again.
///
/// On a lossy link the second rule alone would double without end: at 20 % loss each way more than
/// a third of the steps are ambiguous. Therefore an answer soon after the last resend, within the
/// undoubled timeout or a quarter of the doubled one, counts as the answer to that resend and ends
/// the doubling. This happens for at most kMostGuesses steps in a row, because on a slower link it
/// may be a coincidence that repeats itself.
class RetransmissionTimer {
 public:
  using Duration = std::chrono::nanoseconds;

  /// A shorter timeout would mostly resend states that a busy machine is about to answer.
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
