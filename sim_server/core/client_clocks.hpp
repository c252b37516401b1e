#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/sync/membership.hpp"
#include "sim_server/core/clock_offset.hpp"
#include "sim_server/core/command_sample.hpp"

namespace sls::sim {

/// The controllers' clocks in real time, and how long their answers take. A clock that differs much
/// makes commands expire wrongly or never. Rules: docs/synchronisation.md, "Clocks".
class ClientClocks {
 public:
  /// The states of `step` left at this moment.
  void published(std::uint64_t step, std::chrono::system_clock::time_point wall) {
    published_[step % published_.size()] = wall;
  }
  /// A sample for this run arrived while `step` was in work.
  void note(const CommandSample& sample, std::uint64_t step);

  /// Compares the clocks of `controllers` with ours. Returns what is to be announced: a clock that
  /// is wrong, or agrees again. A clock may also be wrong if the announcements of its client have
  /// old stamps, or if a client is silent that does not repeat them: LIFESPAN may then drop every
  /// answer, so no offset is measurable.
  std::vector<std::string> look(const std::vector<sync::Member>& controllers,
                                std::chrono::nanoseconds lifespan, sync::Time now);
  /// True while LIFESPAN must be ignored, because a clock is or may be wrong.
  bool is_any_wrong() const { return is_any_wrong_; }

 private:
  struct Clock {
    ClockOffset offset;
    sync::Time noted{};  // when it last answered, or else was first seen
    bool is_wrong = false;
  };

  std::map<bus::PeerId, Clock> clocks_;
  /// When the states of the last steps were published, by the clock that sample stamps use.
  std::array<std::chrono::system_clock::time_point, 64> published_;
  bool is_any_wrong_ = false;
};

/// Finds clients whose answers take longer than a period: none of them is in time.
class SlowAnswers {
 public:
  explicit SlowAnswers(sync::Duration period) : period_(period) {}

  /// A sample for this run arrived while `step` was in work. Returns what is to be announced; empty
  /// if nothing is.
  std::string note(const CommandSample& sample, std::uint64_t step);

 private:
  struct Client {  // slow answers in a row
    int count = 0;
    sync::Time since{};
    bool is_reported = false;
  };
  const sync::Duration period_;
  std::map<bus::PeerId, Client> clients_;
};

}  // namespace sls::sim
