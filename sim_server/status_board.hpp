/// The server's reports on a run in sls/status and on stderr.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/core/round_trips.hpp"
#include "sim_server/core/timing_record.hpp"

namespace sls::sim {

class StatusBoard {
 public:
  using Clock = std::chrono::steady_clock;

  /// Longest time between two samples of a run. A longer silence means that something is wrong.
  static constexpr auto kInterval = std::chrono::milliseconds(400);

  /// `write` publishes a sample. `vehicle_id` is the first of the run's; `sum_counters` is called
  /// for every sample.
  StatusBoard(std::function<void(const SimStatus&)> write, std::uint64_t run_id,
              std::uint32_t vehicle_id, const config::Sync& sync,
              std::function<SyncCounters()> sum_counters);

  /// Publishes a sample now.
  void publish(RunPhase phase, const std::string& reason);
  /// Reports an event that does not change the phase: on stderr and as the reason of a sample.
  void announce(const std::string& event);
  /// True if the last sample is kInterval old or older.
  bool is_due() const { return Clock::now() - publish_time_ >= kInterval; }

  RunPhase phase() const { return phase_; }
  /// True once a sample of the run was published.
  bool has_published() const { return samples_ > 0; }

  // Content of the samples; the loop keeps it up to date.
  std::uint64_t step = 0;
  std::string controller_name;  ///< controller of the first vehicle at `step`
  std::string problem;          ///< mistakes of participants; empty if there are none
  TimingRecord timing;
  RoundTrips round_trips;

  /// Call when step 0 is published.
  void start_clock() { start_time_ = Clock::now(); }
  /// Wall time since `start_clock`, less the pauses.
  double calc_wall_s() const;
  /// Simulated over wall time.
  double calc_real_time_factor() const;
  void add_pause(Clock::duration pause) { start_time_ += pause; }

 private:
  const std::function<void(const SimStatus&)> write_;
  const std::uint64_t run_id_;
  const std::uint32_t vehicle_id_;
  const std::int64_t period_ns_;
  const std::function<SyncCounters()> sum_counters_;
  RunPhase phase_ = RunPhase::PHASE_WAITING;
  std::uint64_t samples_ = 0;
  Clock::time_point publish_time_;
  Clock::time_point start_time_;
};

}  // namespace sls::sim
