#include "sim_server/retransmission_timer.hpp"

#include <algorithm>

namespace sls::sim {

RetransmissionTimer::Duration RetransmissionTimer::timeout() const {
  Duration timeout =
      smoothed_ == Duration::zero() ? kInitial : std::clamp(4 * smoothed_, kShortest, kLongest);
  for (int i = 0; i < resends_ && timeout < kLongest; ++i) timeout *= 2;
  return std::min(timeout, kLongest);
}

void RetransmissionTimer::answered(Duration round_trip) {
  if (!is_ambiguous_) {
    smoothed_ = smoothed_ == Duration::zero() ? round_trip : (7 * smoothed_ + round_trip) / 8;
    resends_ = 0;
  }
  is_ambiguous_ = false;
}

void RetransmissionTimer::resent() {
  ++resends_;
  is_ambiguous_ = true;
}

}  // namespace sls::sim
