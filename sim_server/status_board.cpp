#include "sim_server/status_board.hpp"

#include <spdlog/spdlog.h>

#include <utility>

namespace sls::sim {

StatusBoard::StatusBoard(std::function<void(const SimStatus&)> write, std::uint64_t run_id,
                         std::uint32_t vehicle_id, const config::Sync& sync,
                         std::function<SyncCounters()> sum_counters)
    : timing(sync),
      write_(std::move(write)),
      run_id_(run_id),
      vehicle_id_(vehicle_id),
      period_ns_(sync.period_ns),
      sum_counters_(std::move(sum_counters)) {}

double StatusBoard::calc_wall_s() const {
  if (start_time_ == Clock::time_point{}) return 0.0;
  return std::chrono::duration<double>(Clock::now() - start_time_).count();
}

double StatusBoard::calc_real_time_factor() const {
  const double wall_s = calc_wall_s();
  return wall_s > 0.0 ? static_cast<double>(step) * period_ns_ * 1e-9 / wall_s : 0.0;
}

void StatusBoard::publish(RunPhase phase, const std::string& reason) {
  phase_ = phase;
  publish_time_ = Clock::now();
  SyncCounters counters = sum_counters_();
  timing.fill(counters);
  SimStatus message;
  message.run_id(run_id_);
  message.vehicle_id(vehicle_id_);
  message.sample_index(samples_++);
  message.phase(phase);
  message.reason(reason);
  message.step(step);
  message.controller_name(controller_name);
  message.real_time_factor(calc_real_time_factor());
  message.round_trip_p50_ns(static_cast<std::uint64_t>(round_trips.calc_percentile(50).count()));
  message.round_trip_p99_ns(static_cast<std::uint64_t>(round_trips.calc_percentile(99).count()));
  message.timing(timing.label());
  message.problem(problem);
  message.counters(counters);
  write_(message);
}

void StatusBoard::announce(const std::string& event) {
  spdlog::warn("{}", event);
  publish(phase_, event);
}

}  // namespace sls::sim
