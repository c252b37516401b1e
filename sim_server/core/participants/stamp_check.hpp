/// Source timestamps in the future: the clock of the sender is wrong, or it stamps its samples
/// itself. In real time such a sample outlives its LIFESPAN.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <utility>

#include "common/bus/peer.hpp"

namespace sls::sim {

class StampCheck {
 public:
  using Clock = std::chrono::system_clock;
  static constexpr std::chrono::seconds kTolerance{1};
  static constexpr std::size_t kMostSenders = 64;

  /// A sample of `sender` carries the timestamp `written`. `read_clock` returns the time now; it is
  /// called about once in `kTolerance`, not for each sample.
  template <class ReadClock>
  void note(const bus::PeerId& sender, Clock::time_point written, ReadClock read_clock) {
    if (written <= latest_) return;
    const Clock::time_point now = read_clock();
    latest_ = now + kTolerance;
    if (written <= latest_ || (ahead_s_.size() >= kMostSenders && ahead_s_.count(sender) == 0))
      return;
    ahead_s_[sender] = std::chrono::duration<double>(written - now).count();
  }

  /// Senders of samples from the future since the last call, and how far ahead the last one was, s.
  std::map<bus::PeerId, double> take() { return std::exchange(ahead_s_, {}); }

 private:
  Clock::time_point latest_;  // a timestamp up to this one is certainly in order
  std::map<bus::PeerId, double> ahead_s_;
};

}  // namespace sls::sim
