/// One vehicle of a run: its faults, who may answer for it, and what flies it. No
/// network here.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "common/config/scenario.hpp"
#include "sim_server/command_gate.hpp"
#include "sim_server/controller_absence.hpp"
#include "sim_server/fault_line.hpp"
#include "sim_server/messages.hpp"

namespace sls::sim {

class VehicleFlight {
 public:
  using Clock = std::chrono::steady_clock;

  /// Vehicle `id` of `fleet`, at rest where the scenario puts it.
  VehicleFlight(const config::Scenario& fleet, std::uint32_t id, std::uint64_t run_id);

  VehicleFlight(const VehicleFlight&) = delete;
  VehicleFlight& operator=(const VehicleFlight&) = delete;

  std::uint32_t id() const { return id_; }

  /// The result of a step.
  struct Outcome {
    Applied applied;           // before faults
    bool is_finished = false;  // the mission ends here
  };

  /// The state of `step` as it is published, where the plant does `truth` and sensors and estimator
  /// say `seen`; null if that cannot differ. Call once per step, in order, from step 0.
  VehicleState measure(std::uint64_t step, const model::Measurement& truth,
                       const model::Measurement* seen = nullptr);
  /// Takes the answer that the gate accepted for the step in work.
  void take_answer();
  /// Keeps an answer that came too late for its step, to be held: fresh where it is newer than the
  /// one that is held. Older ones do not count.
  void keep_late_answer(const OfferedAnswer& answer);
  /// Flies the step in work without an answer of its own.
  void fly_without_answer(ControllerAbsence::Action action);
  /// Flies the step in work with what it came to: the force (N, in W) that acts on the plant.
  Eigen::Vector3d actuate();

  /// Puts what is to be recorded of the step in work into `entry`, once all is known of it.
  void fill_record(RecordEntry& entry) const;

  const std::optional<Outcome>& outcome() const { return outcome_; }
  bool is_settled() const { return outcome_.has_value(); }
  /// Periods between the state that the force of the step in work answers and that step.
  std::uint64_t calc_age() const;
  /// A late answer has ended the mission.
  bool has_ended_late() const { return has_ended_late_; }
  const Applied& last_answer() const { return last_answer_; }
  /// The controller memory that the current step's state sent back.
  const ControllerState& returned() const { return applied_.memory; }
  /// Motion of the vehicle at the current step.
  const model::Measurement& state() const { return state_; }

  /// The step in work was published at `time` and has no answer yet.
  void note_waiting(Clock::time_point time) {
    if (!absent_since_) absent_since_ = time;
  }
  /// Since the first step without a fresh answer was published; 0 if the last one had one.
  double calc_absence_s() const;
  /// Answers were refused, or none is any more.
  void note_refused(bool is_refused) {
    if (is_refused != refused_since_.has_value())
      refused_since_ = is_refused ? std::optional(Clock::now()) : std::nullopt;
  }
  /// Since answers are refused without a valid one; 0 if none is.
  double calc_refused_s() const;
  /// The run was at rest for so long, which is no absence.
  void note_rest(Clock::duration rest);

  CommandGate gate;
  ControllerAbsence absence;

 private:
  void hold(const OfferedAnswer& answer);

  const std::uint32_t id_;
  const config::Scenario scenario_;  // of this vehicle alone
  FaultLine faults_;
  std::uint64_t step_ = 0;              // in work
  model::Measurement state_;            // at that step
  model::Measurement measured_;         // of it
  bool can_measured_differ_ = false;    // from that state
  Applied applied_;                     // over the period before it
  std::optional<Outcome> outcome_;      // of the step in work, once it is known
  Applied last_answer_;                 // accepted, or late but valid; what is held
  std::uint64_t last_answer_step_ = 0;  // the step it answers
  ControlCommand last_command_;         // as it came
  bool has_ended_late_ = false;
  std::optional<Clock::time_point> absent_since_;
  std::optional<Clock::time_point> refused_since_;
};

}  // namespace sls::sim
