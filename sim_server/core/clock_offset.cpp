#include "sim_server/core/clock_offset.hpp"

#include <algorithm>

namespace sls::sim {

void ClockOffset::note(const Exchange& exchange) {
  const std::chrono::nanoseconds whole = exchange.arrived - exchange.published;
  if (whole.count() < 0) return;  // our clock was set
  const auto computing =
      std::clamp<std::chrono::nanoseconds>(exchange.computing, std::chrono::nanoseconds(0), whole);
  const auto round_trip = whole - computing;  // of the network alone
  const auto age = exchange.arrived - began_;
  if (age < age.zero() || age > kMemory) {
    earlier_ = age > 2 * kMemory ? std::nullopt : current_;
    current_.reset();
    began_ = exchange.arrived;
  }
  keep_shorter(current_, {round_trip, exchange.written - (exchange.arrived - round_trip / 2)});
  answers_ = std::min(answers_ + 1, kLeastAnswers);
}

std::optional<std::chrono::nanoseconds> ClockOffset::offset() const {
  if (answers_ < kLeastAnswers) return std::nullopt;
  std::optional<Best> best = current_;
  if (earlier_) keep_shorter(best, *earlier_);
  return best->offset;
}

void ClockOffset::keep_shorter(std::optional<Best>& best, const Best& other) {
  if (!best || other.round_trip < best->round_trip) best = other;
}

}  // namespace sls::sim
