/// One vehicle of a run: its faults, its command gate and the force of each step. No network and no
/// clock here.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>

#include "common/config/scenario.hpp"
#include "common/model/measurement.hpp"
#include "common/sync/time.hpp"
#include "sim_server/core/command_gate.hpp"
#include "sim_server/core/controller_absence.hpp"
#include "sim_server/fault_line.hpp"

namespace sls::sim {

/// Force that acted over a control period, its origin, and the controller memory after it.
struct Applied {
  Eigen::Vector3d answer_f_Q_W = Eigen::Vector3d::Zero();  ///< as answered, N
  Eigen::Vector3d f_Q_W = Eigen::Vector3d::Zero();         ///< as it acted, after faults, N
  ForceOrigin origin = ForceOrigin::FORCE_NONE;
  std::string controller_name;
  ControllerState memory;
};

/// `controller_name` of the server's own force.
inline constexpr const char* kFailSafeName = "fail-safe";

class Vehicle {
 public:
  /// Vehicle `id` of `fleet`, before step 0.
  Vehicle(const config::Scenario& fleet, std::uint32_t id, std::uint64_t run_id);

  Vehicle(const Vehicle&) = delete;
  Vehicle& operator=(const Vehicle&) = delete;

  std::uint32_t id() const { return id_; }

  /// The result of a step.
  struct Outcome {
    Applied applied;           // before faults
    bool is_finished = false;  // the mission ends here
  };

  /// Measures the state of `step`. `truth` is the state of the plant; `seen` is the output of
  /// sensors and estimator, or null if it cannot differ. Call once per step, in order, from step 0.
  void measure(std::uint64_t step, const model::Measurement& truth,
               const model::Measurement* seen = nullptr);
  /// Takes the answer that the gate accepted for the step in work.
  void take_answer();
  /// Holds an answer that came too late for its step, if it is newer than the held one.
  void keep_late_answer(const OfferedAnswer& answer);
  /// Flies the step in work without an answer of its own.
  void fly_without_answer(ControllerAbsence::Action action);
  /// Applies the outcome of the step in work. Returns the force (N, in W) that acts on the plant.
  Eigen::Vector3d actuate();

  /// Writes the record of the step in work into `entry`. Call once its outcome is known or the run
  /// ends.
  void fill_record(RecordEntry& entry) const;

  const std::optional<Outcome>& outcome() const { return outcome_; }
  bool is_settled() const { return outcome_.has_value(); }
  /// Age of the force of the step in work: periods since the state that it answers.
  std::uint64_t calc_age() const;
  /// True if the newest answer was late and says that the mission is finished.
  bool has_ended_late() const { return has_ended_late_; }
  const Applied& last_answer() const { return last_answer_; }
  /// Name of the client whose answer is in force: in the step in work once its outcome is known.
  const std::string& controller_name() const {
    return outcome_ ? outcome_->applied.controller_name : applied_.controller_name;
  }
  /// The force over the period before the step in work.
  const Applied& applied() const { return applied_; }
  /// The measured state of the step in work.
  const model::Measurement& measured() const { return measured_; }
  /// Motion of the vehicle at the current step.
  const model::Measurement& state() const { return state_; }

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
  ControllerAbsence absence;

 private:
  void hold(const OfferedAnswer& answer);

  const std::uint32_t id_;
  const config::Scenario scenario_;  // of this vehicle alone
  FaultLine faults_;
  std::uint64_t step_ = 0;              // in work
  model::Measurement state_;            // at that step
  model::Measurement measured_;         // of that state
  bool can_measured_differ_ = false;    // from that state
  Applied applied_;                     // over the period before it
  std::optional<Outcome> outcome_;      // of the step in work, once it is known
  Applied last_answer_;                 // the held one: accepted, or late but valid
  std::uint64_t last_answer_step_ = 0;  // the step it answers
  ControlCommand last_command_;         // as received
  bool has_ended_late_ = false;
  std::optional<sync::Time> absent_since_;
  std::optional<sync::Time> refused_since_;
};

}  // namespace sls::sim
