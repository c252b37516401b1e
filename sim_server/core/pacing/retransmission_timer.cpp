#include "sim_server/core/pacing/retransmission_timer.hpp"

#include <algorithm>

namespace sls::sim {

RetransmissionTimer::Duration RetransmissionTimer::calc_undoubled() const {
  return smoothed_ == Duration::zero() ? kInitial : std::clamp(4 * smoothed_, kShortest, kLongest);
}

RetransmissionTimer::Duration RetransmissionTimer::timeout() const {
  Duration timeout = calc_undoubled();
  for (int i = 0; i < resends_ && timeout < kLongest; ++i) timeout *= 2;
  return std::min(timeout, kLongest);
}

void RetransmissionTimer::answered(Duration since_first, Duration since_last) {
  if (!is_ambiguous_) {
    smoothed_ = smoothed_ == Duration::zero() ? since_first : (7 * smoothed_ + since_first) / 8;
    resends_ = 0;
    guesses_ = 0;
  } else if (since_last < std::max(calc_undoubled(), timeout() / 4) && guesses_ < kMostGuesses) {
    resends_ = 0;
    ++guesses_;
  }
  is_ambiguous_ = false;
}

void RetransmissionTimer::resent() {
  ++resends_;
  is_ambiguous_ = true;
}

}  // namespace sls::sim
