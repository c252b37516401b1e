/// One vehicle of a run: its command gate and the answer in force at each step. No network and no
/// clock here.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/config/scenario.hpp"
#include "common/model/step_record.hpp"
#include "common/sync/time.hpp"
#include "sim_server/core/answers/command_gate.hpp"

namespace sls::sim {

/// Name of the client in records of the server's own force.
inline constexpr const char* kFailSafeName = "fail-safe";

/// Force (N, in W) that the server applies when no controller has answered for too long. It holds
/// the weight (m + m_L) g and damps the quadrotor's velocity; the time constant of the whole mass
/// is 1 s. Its norm is at most `force_limit`. Source: sim_server/README.md, eq. (5).
Eigen::Vector3d calc_fail_safe_force(const model::SlungLoadParameters& vehicle,
                                     const model::SlungLoadState& state, double force_limit);

/// Reaction to a missing answer, by `sync.wait.controller`. Rules:
/// docs/synchronisation.md, "Waiting for participants".
enum class AbsenceAction {
  kWait,      ///< wait for the answer
  kHold,      ///< fly this step with the last answer
  kFailSafe,  ///< fly this step with the fail-safe force
  kGiveUp,    ///< end the run as failed
};

class Vehicle {
 public:
  /// The vehicle of `fleet` whose step in work is in `record`, before step 0.
  Vehicle(const config::Scenario& fleet, std::uint64_t run_id, model::StepRecord& record);

  Vehicle(const Vehicle&) = delete;
  Vehicle& operator=(const Vehicle&) = delete;

  std::uint32_t id() const { return record_.vehicle_id; }

  // --- a step, in the order of the calls ---

  /// Goes on to the step that is in the record now.
  void begin_step() { is_settled_ = false; }
  /// Takes the answer that the gate accepted for the step in work.
  void take_answer();
  /// Flies the step in work without an answer of its own.
  void fly_without_answer(AbsenceAction action);
  /// Holds an answer that came too late for its step, if it is newer than the held one.
  void keep_late_answer(const OfferedAnswer& offered);

  // --- the step in work ---

  /// Motion of the vehicle.
  const model::Measurement& state() const { return record_.truth; }
  /// The client whose force acts: over the step in work once it is settled, else before it.
  const std::string& flown_by() const { return flown_by_; }
  /// True if its force is known.
  bool is_settled() const { return is_settled_; }
  /// Its record. Until it is settled, kind, client and answer are those of the period before it.
  const model::StepRecord& record() const { return record_; }
  /// Completes the record of a step that is not settled, because the run ends: with the answer that
  /// was accepted or refused, if there is one.
  void complete_record();
  /// True if the answer in its record, which must be settled, ends the mission.
  bool is_finished() const;
  /// Age of its force: periods since the state that it answers.
  std::uint64_t calc_age() const { return record_.step - record_.answered_step; }

  /// The client that sent the newest valid answer; empty before the first one.
  const std::string& last_client() const { return held_.client_name; }
  /// True if the newest answer was late and says that the mission is finished.
  bool has_ended_late() const { return has_ended_late_; }

  // --- absence ---

  /// Reaction to the step in work, which has waited `step_wait_s` (wall time) for its answer. In
  /// real time the call comes when the step's period is over, and the result is never kWait.
  AbsenceAction decide(const config::Sync& rules, double step_wait_s, sync::Time now) const;
  /// True if the last step was flown without an answer, and none has come since.
  bool is_absent() const { return steps_without_answer_ > 0; }
  /// The step in work was published at `time` and has no answer yet.
  void note_waiting(sync::Time time) {
    if (!absent_since_) absent_since_ = time;
  }
  /// Time since the first step without a fresh answer was published, s; 0 if the last step had one.
  double calc_absence_s(sync::Time now) const;
  /// Notes if answers are refused at present.
  void note_refused(bool is_refused, sync::Time now) {
    if (is_refused != refused_since_.has_value())
      refused_since_ = is_refused ? std::optional(now) : std::nullopt;
  }
  /// Time for which answers are refused without a valid one, s; 0 if none is refused.
  double calc_refused_s(sync::Time now) const;
  /// The run was at rest for `rest`, which does not count as absence.
  void note_rest(sync::Duration rest);

  CommandGate gate;

 private:
  void hold(const OfferedAnswer& offered);
  void settle(model::AnswerKind kind);

  const model::SlungLoadParameters parameters_;
  const double force_limit_n_;
  model::StepRecord& record_;  // of the step in work
  bool is_settled_ = false;    // its force is known
  std::string flown_by_;
  OfferedAnswer held_;  // the newest valid answer: accepted, or late
  bool has_held_ = false;
  bool has_ended_late_ = false;
  std::uint64_t steps_without_answer_ = 0;  // flown, since the last fresh answer
  std::optional<sync::Time> absent_since_;
  std::optional<sync::Time> refused_since_;
};

/// The record of an answer that came too late for its step.
model::StepRecord make_late_record(const Vehicle& vehicle, const OfferedAnswer& offered);

}  // namespace sls::sim
