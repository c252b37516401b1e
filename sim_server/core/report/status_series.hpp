#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include "common/config/scenario.hpp"
#include "common/sync/time.hpp"
#include "sim_server/core/report/timing_record.hpp"
#include "sls.h"

namespace sls::sim {

/// The last 1,000 round trips. `add` is cheap; a percentile reads all of them.
class RoundTrips {
 public:
  using Duration = std::chrono::nanoseconds;

  static constexpr std::size_t kCapacity = 1000;

  void add(Duration round_trip);

  /// The smallest round trip that `percent` % (1 to 100) of those held do not exceed (nearest
  /// rank); zero before the first.
  Duration calc_percentile(int percent) const;

 private:
  std::array<Duration, kCapacity> values_{};
  std::size_t count_ = 0;  // held, at most kCapacity
  std::size_t next_ = 0;   // index of the next one
};

/// Makes the samples of sls/status of a run.
class StatusSeries {
 public:
  /// Longest time between two samples of a run. A longer silence means that something is wrong.
  static constexpr auto kInterval = std::chrono::milliseconds(400);

  /// Run `run_id`, whose first vehicle is `vehicle_id`.
  StatusSeries(std::uint64_t run_id, std::uint32_t vehicle_id, const config::Sync& sync)
      : timing(sync), run_id_(run_id), vehicle_id_(vehicle_id), period_ns_(sync.period_ns) {}

  /// Content of a sample.
  struct Content {
    RunPhase phase = RunPhase::PHASE_WAITING;
    std::string reason;
    std::uint64_t step = 0;
    std::string controller_name;  ///< of the first vehicle at `step`
    std::string problem{};        ///< mistakes of participants; empty if there are none
    SyncCounters counters{};      ///< without those of `timing`
  };
  /// The next sample.
  SimStatus make(const Content& content, sync::Time now);
  /// True if the last sample is kInterval old or older.
  bool is_due(sync::Time now) const { return now - made_ >= kInterval; }
  /// Number of samples so far.
  std::uint64_t size() const { return size_; }

  /// Step 0 is about to be published.
  void begin(sync::Time now) { began_ = now; }
  /// A rest does not count in the real-time factor.
  void note_rest(sync::Duration rest) { began_ += rest; }
  /// Wall time since `begin`, less the rests, s.
  double calc_wall_s(sync::Time now) const {
    return began_ == sync::Time{} ? 0.0 : sync::to_seconds(now - began_);
  }

  TimingRecord timing;
  RoundTrips round_trips;

 private:
  const std::uint64_t run_id_;
  const std::uint32_t vehicle_id_;
  const std::int64_t period_ns_;
  std::uint64_t size_ = 0;
  sync::Time made_{};
  sync::Time began_{};
};

}  // namespace sls::sim
