#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>

#include "sim_server/core/clock_offset.hpp"
#include "sim_server/core/schedule.hpp"
#include "sim_server/run.hpp"

namespace sls::sim {

/// The server advances on the monotonic clock. A period is flown with the answer to the state at
/// its beginning if the answer came before its end. Otherwise the newest valid answer is held
/// (zero-order hold); after `max_hold_s` the fail-safe force acts. A run without late answers is
/// the same, bit for bit, as in lockstep. States go through a queue, so the loop waits for no
/// reader.
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

  // Periods may be long. While these functions wait, they handle operator, signals and status. They
  // return false if the operator ended the run.
  bool wait_until_due();
  /// Takes commands until `deadline`, or until every vehicle has its answer. The period can then be
  /// integrated before its end, so the next state is ready when it is due.
  bool take_commands(Clock::time_point deadline);
  /// Waits for the answers to the last step, after late answers have ended the mission.
  bool wait_for_last_answers();

  void publish();
  void note_late(Vehicle& vehicle, const OfferedAnswer& offered) override;
  /// True when the mission is over for every vehicle, also by an answer that came late.
  bool is_ending() const;
  void fly_without_answers();
  void count_missed_deadlines();
  /// Measures the clock of the sender.
  void note_clock(const ReceivedCommands& received);
  /// Reports a client whose answers take longer than a period: none of them is in time.
  void note_computing(const ReceivedCommands& received);
  /// On a terminal, where a flight that is not heard for long looks as if it hung.
  void report_progress();
  /// Reports a client whose clock differs so much that its commands would expire wrongly or never,
  /// and when the clocks agree again. Meanwhile LIFESPAN is ignored: commands expire by their step
  /// alone. It is also ignored where old announcements suggest a wrong clock: if it is wrong, no
  /// answer arrives that would show it.
  void check_clocks();
  void announce_clock(const sync::Member& client, std::chrono::nanoseconds offset, bool is_wrong);

  StateStream::Queue state_queue_;
  Schedule schedule_;
  Clock::time_point published_;         // when the state in work was published
  std::uint64_t missed_deadlines_ = 0;  // count of the middleware at the last check
  /// A ready controller's clock.
  struct ClientClock {
    ClockOffset offset;
    Clock::time_point noted;
    bool is_wrong = false;
  };
  std::map<bus::PeerId, ClientClock> clocks_;
  /// When the states of the last steps were published, by the clock that sample stamps use.
  std::array<std::chrono::system_clock::time_point, 64> published_stamps_;
  struct SlowAnswers {  // in a row
    int count = 0;
    Clock::time_point since;
    bool is_reported = false;
  };
  std::map<bus::PeerId, SlowAnswers> slow_answers_;
  Clock::time_point next_progress_;
  bool is_lifespan_ignored_ = false;
  std::optional<app::Wait> recorder_wait_;
};

}  // namespace sls::sim
