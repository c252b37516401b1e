#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/sync/membership.hpp"
#include "sim_server/core/answers/command_sample.hpp"

namespace sls::sim {

/// How far the clock of a client is ahead of ours, from its answers.
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
  /// kLeastAnswers. Link delay does not enter if it is equal both ways; a difference enters with
  /// its half.
  std::optional<std::chrono::nanoseconds> offset() const;

  static constexpr int kLeastAnswers = 8;
  /// The shortest round trip of the last one to two such times counts: then a clock that was set
  /// right is seen.
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
