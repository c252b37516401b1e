#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "common/bus/queued_writer.hpp"
#include "sim_server/run.hpp"
#include "sim_server/schedule.hpp"

namespace sls::sim {

/// The server advances on the monotonic clock. A period is flown with the answer to the state at
/// its beginning if that came before its end, else with the newest valid answer (zero-order hold),
/// after `max_hold_s` with the fail-safe force. A run none of whose answers was late is the same,
/// bit for bit, as in lockstep. Nothing here waits for a reader: states go through a queue.
class RealtimeRun : public Run {
 public:
  RealtimeRun(Endpoints& endpoints, const config::Scenario& scenario, std::uint64_t run_id,
              std::uint32_t vehicle_id, bool begins_paused);

 private:
  void begin() override;
  std::optional<Outcome> exchange(const VehicleState& state) override;
  bool wait_for_recorders(std::uint64_t step) override;
  void rested(Clock::duration rest) override;

  void publish(const VehicleState& state);
  /// Takes commands until `deadline`, or until one for the awaited step ends the mission.
  void take_commands(Clock::time_point deadline);
  void take_late(const ControlCommand& command);
  /// The answer to the last step, which is waited for: an earlier answer said it is the last.
  void wait_for_last_answer(const VehicleState& state);
  void count_missed_deadlines();
  /// Says whose clock differs from ours by what would make his commands expire when they should
  /// not, or never; from then on they are judged by their step alone.
  void check_clocks();

  bus::QueuedWriter<VehicleState> state_queue_;
  Schedule schedule_;
  Clock::time_point published_;         // when the state in work was
  bool is_ending_ = false;              // a late answer has ended the mission
  std::uint64_t missed_deadlines_ = 0;  // of the middleware, up to the last look
  bool is_lifespan_ignored_ = false;
  std::optional<app::Wait> recorder_wait_;
};

}  // namespace sls::sim
