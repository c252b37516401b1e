#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "sim_server/run.hpp"
#include "sim_server/schedule.hpp"

namespace sls::sim {

/// The server advances on the monotonic clock. A period is flown with the answer to the state at
/// its beginning if that came before its end, else with the newest valid answer (zero-order hold),
/// after `max_hold_s` with the fail-safe force. A run none of whose answers was late is the same,
/// bit for bit, as in lockstep. Nothing here waits for a reader: states go through a queue.
class RealtimeRun : public Run {
 public:
  RealtimeRun(Endpoints& endpoints, const Assignment& assignment, WorkerPool& workers,
              std::uint64_t run_id, bool begins_paused);

 private:
  void begin() override;
  bool exchange() override;
  bool wait_for_recorders() override;
  void roster_changed() override { check_clocks(); }
  void note_rest(Clock::duration rest) override;

  // Periods may be long: these attend to operator, signals and status meanwhile, and return false
  // if the operator ended the run.
  bool wait_until_due();
  /// Takes commands until `deadline`, or until every vehicle has its answer: the period can then be
  /// flown ahead of its end, and the next state is ready when it is due.
  bool take_commands(Clock::time_point deadline);
  /// The answers to the last step, which are waited for: earlier ones said it is the last.
  bool wait_for_last_answers();

  void publish();
  void note_late(VehicleFlight& vehicle, const OfferedAnswer& answer) override;
  /// True when the mission is over for every vehicle, also by an answer that came late.
  bool is_ending() const;
  void fly_without_answers();
  void count_missed_deadlines();
  /// Reports a client whose clock differs so much that its commands would expire wrongly or never;
  /// from then on they are judged by their step alone.
  void check_clocks();

  StateStream::Queue state_queue_;
  Schedule schedule_;
  Clock::time_point published_;         // when the state in work was
  std::uint64_t missed_deadlines_ = 0;  // of the middleware, up to the last look
  bool is_lifespan_ignored_ = false;
  std::optional<app::Wait> recorder_wait_;
};

}  // namespace sls::sim
