/// One run of the server, from its run_id to its end: waits for the participants, flies the
/// scenario step by step, attends to operator and recorders. How a step gets its force is what
/// lockstep_run.hpp and realtime_run.hpp add.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "common/app/wait.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/command_gate.hpp"
#include "sim_server/controller_absence.hpp"
#include "sim_server/endpoints.hpp"
#include "sim_server/fault_line.hpp"
#include "sim_server/messages.hpp"
#include "sim_server/roster.hpp"
#include "sim_server/run_control.hpp"
#include "sim_server/slung_load_plant.hpp"
#include "sim_server/status_board.hpp"

namespace sls::sim {

class Run {
 public:
  /// Announces run `run_id` of `scenario` in sls/parameters. It begins at rest if `begins_paused`.
  Run(Endpoints& endpoints, const config::Scenario& scenario, std::uint64_t run_id,
      std::uint32_t vehicle_id, bool begins_paused);
  virtual ~Run() = default;
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  enum class End { kFinished, kReset };

  /// Waits for the participants, then flies to the end and says so.
  /// @throws std::exception saying why the run failed: then call `fail`.
  End execute();

  /// Tells everybody that the run failed.
  void fail(const std::string& reason);

  std::uint64_t run_id() const { return run_id_; }
  /// True once participants may have joined.
  bool is_known() const { return board_.has_published(); }
  bool is_paused() const { return control_.is_paused(); }

  /// Recorders that are to have the whole run: those the scenario expects, unless given up.
  int expected_recorders() const {
    return are_recorders_given_up_ ? 0 : scenario_.sync.wait_for.recorders;
  }

  /// @throws app::RunError if another server has the better claim to the vehicle.
  void check_claim() const;
  /// @throws app::RunError after a stop signal.
  static void check_stop();

 protected:
  using Clock = std::chrono::steady_clock;

  /// What a step came to.
  struct Outcome {
    Applied applied;           // but for the faults
    bool is_finished = false;  // the mission ends here; nothing is applied
  };

  /// Step 0 is about to be published.
  virtual void begin() {}
  /// Publishes `state` and returns what came of it; nothing if the operator ended the run.
  virtual std::optional<Outcome> exchange(const VehicleState& state) = 0;
  /// Whether `step` may be published as far as the recorders are concerned; false if the operator
  /// ended the run meanwhile.
  virtual bool wait_for_recorders(std::uint64_t step) = 0;
  /// The run was at rest for so long.
  virtual void rested(Clock::duration rest) = 0;

  // For both ways of stepping.
  void judge(const ReceivedCommand& received);
  Outcome take_accepted_answer();
  /// Flies `step` without an answer of its own.
  Outcome fly_without_answer(std::uint64_t step, ControllerAbsence::Action action);
  /// Says now and then who is missing since when, also in sls/status. @throws app::RunError to give
  /// the run up.
  void attend_to_absence(std::uint64_t step, ControllerAbsence::Action action);
  double calc_absence_s() const;
  std::string name_awaited_controller() const;
  void report_silent_recorder();

  /// Takes the operator's requests; true if one of them ended the run.
  bool attend_to_operator();
  void refresh_roster();
  void refresh_roster_if_due();
  /// Status, stop signal, claim: what needs a look a few times a second.
  void attend_now_and_then();

  Endpoints& endpoints_;
  const config::Scenario scenario_;
  const std::uint64_t run_id_;
  const std::uint32_t vehicle_id_;

  CommandGate gate_;
  StatusBoard board_;
  RunControl control_;
  ControllerAbsence absence_;
  Roster roster_;
  Applied last_answer_;                     // accepted, or late but valid; what is held
  std::uint64_t last_answer_step_ = 0;      // the step it answers
  bool are_recorders_given_up_ = false;     // policy go_on
  std::optional<Clock::time_point> began_;  // when step 0 was about to be published
  model::SlungLoadState state_;             // of the plant at the step in work

 private:
  bool is_meant_for_another_server(const SimControl& request) const;
  bool wait_for_participants();
  bool fly();
  /// Waits while the operator holds the run; false if a request ended it.
  bool rest();
  void finish();
  void reset();
  void close_requests(const std::string& reason);

  std::uint64_t roster_version_ = 0;
  Clock::time_point roster_time_;
  std::optional<Clock::time_point> absent_since_;  // when the first unanswered step was published
  std::optional<app::Wait> absence_wait_;
  bool is_absence_announced_ = false;
  std::optional<ControllerAbsence::Action> absence_action_;  // announced last
  std::optional<Clock::time_point> recorder_report_time_;

 protected:
  /// A step was published at `time` and has no answer yet.
  void note_waiting(Clock::time_point time) {
    if (!absent_since_) absent_since_ = time;
  }
};

}  // namespace sls::sim
