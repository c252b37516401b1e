/// One run of the server, from its run_id to its end: waits for the participants, flies the
/// vehicles step by step, handles operator and recorders. The derived classes in lockstep_run.hpp
/// and realtime_run.hpp decide how a step gets its forces.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/app/wait.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/core/controller_absence.hpp"
#include "sim_server/core/participant_check.hpp"
#include "sim_server/core/presence.hpp"
#include "sim_server/core/roster.hpp"
#include "sim_server/core/run_control.hpp"
#include "sim_server/core/vehicle.hpp"
#include "sim_server/endpoints.hpp"
#include "sim_server/plants/plant.hpp"
#include "sim_server/record_stream.hpp"
#include "sim_server/status_board.hpp"
#include "sim_server/worker_pool.hpp"

namespace sls::sim {

/// The scenario and the vehicles of a server.
struct Assignment {
  config::Scenario scenario;
  std::vector<std::uint32_t> vehicle_ids;  ///< of the scenario's, ascending; at least one
};

class Run {
 public:
  /// Announces run `run_id` of `assignment` in sls/parameters. The run begins paused
  /// if `begins_paused`.
  Run(Endpoints& endpoints, const Assignment& assignment, WorkerPool& workers, std::uint64_t run_id,
      bool begins_paused);
  virtual ~Run() = default;
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  enum class End { kFinished, kReset };

  /// Waits for the participants, flies to the end and publishes the end.
  /// @throws std::exception with the reason if the run failed: then call `fail`.
  End execute();

  /// Publishes that the run failed.
  void fail(const std::string& reason);

  std::uint64_t run_id() const { return run_id_; }
  /// True once participants may have joined.
  bool is_known() const { return board_.has_published(); }
  bool is_paused() const { return control_.is_paused(); }

  /// Number of recorders that must get the whole run: as the scenario expects, or 0 once given up.
  int expected_recorders() const {
    return are_recorders_given_up_ ? 0 : scenario_.sync.wait_for.recorders;
  }

  /// @throws app::RunError if another server has the better claim to one of the vehicles.
  void check_claim() const;
  /// @throws app::RunError after a stop signal.
  static void check_stop();

 protected:
  using Clock = std::chrono::steady_clock;

  /// Called before step 0 is published.
  virtual void begin() {}
  /// Publishes the states of the step in work, and decides the force of each vehicle; false
  /// if the operator ended the run.
  virtual bool exchange() = 0;
  /// Waits until the recorders allow the step in work to be published, if the mode waits for them;
  /// false if the operator ended the run meanwhile.
  virtual bool wait_for_recorders() = 0;
  /// Called after each update of the roster.
  virtual void roster_changed() {}
  /// Called when the run was at rest for `rest`, which counts neither as absence nor as delay.
  virtual void note_rest(Clock::duration rest);

  /// Publishes the states of the step in work.
  void publish_states();

  // For both ways of stepping (run_answers.cpp).
  /// Judges the answers of one sample, and records those that are late; `is_early`: it came
  /// before the states of its step were published.
  void judge(const Commands& sample, const bus::PeerId& sender, bool is_early = false);
  /// Called for a valid answer to an earlier step.
  virtual void note_late(Vehicle&, const OfferedAnswer&) {}
  Vehicle* find_vehicle(std::uint32_t id);
  /// True if every vehicle's answer to the step in work was accepted.
  bool are_all_accepted() const;
  /// True if a vehicle's last step was flown without an answer, and none has come since.
  bool is_anybody_absent() const;
  /// @throws app::RunError if a client's answer was refused and no other client answers.
  void check_refusals();
  /// Takes the accepted answers. Announces take-overs and controllers that answer again.
  void take_answers();
  /// Reports absent controllers at intervals, also in sls/status.
  /// @throws app::RunError if `action` is kGiveUp.
  void attend_to_absence(ControllerAbsence::Action action);
  /// Names the controllers whose answers are awaited.
  std::string name_awaited_controllers() const;

  /// Flies the period that begins with the step in work, and goes on to the next step.
  void advance();
  bool is_finished() const;

  /// Takes the operator's requests; true if one of them ended the run.
  bool attend_to_operator();
  /// Takes the requests and waits while the operator holds the run; false if a request ended it.
  bool rest();
  /// Also finds participants that have fallen silent or come back: call it several times a second.
  void refresh_roster();
  bool is_roster_due() const;
  /// Publishes the status and checks signals, claim and participants; a few times a second.
  void do_housekeeping();
  /// True if the participants should be checked before the next status is due.
  bool is_look_due() const;
  std::string describe_problem() const;

  Endpoints& endpoints_;
  const config::Scenario scenario_;
  const std::vector<std::uint32_t> vehicle_ids_;
  const std::uint64_t run_id_;

  std::vector<std::unique_ptr<Vehicle>> vehicles_;  // as vehicle_ids_
  std::vector<const model::StepRecord*> records_;   // of the vehicles
  SyncCounters link_;                               // counts that belong to no single vehicle
  StatusBoard board_;
  RunControl control_;
  Roster roster_;
  ParticipantCheck check_;
  Presence presence_;
  RecordStream record_;
  bool are_recorders_given_up_ = false;     // policy go_on
  std::optional<Clock::time_point> began_;  // when step 0 was about to be published

 private:
  bool is_meant_for_another_server(const SimControl& request) const;
  std::map<bus::PeerId, Answering> collect_answering();
  bool wait_for_participants();
  bool fly();
  void measure(const PlantOfVehicles& group);
  /// Advances one plant over a period.
  void advance(PlantOfVehicles& group);
  /// Sends the step in work to the recorders if its states were published.
  void record_step();
  void record_late(const Vehicle& vehicle, const OfferedAnswer& offered);
  void finish();
  void reset();
  void publish_end(RunPhase phase, const std::string& reason);
  void close_requests(const std::string& reason);
  void report_silent_recorder();
  /// Looks for mistakes of the participants.
  void look_for_problems();
  const std::set<bus::PeerId>& find_informed();
  /// Announces the plants' remarks on their vehicles.
  void announce_remarks();
  SyncCounters sum_counters() const;
  std::string describe_refusals(const Vehicle& vehicle) const;
  [[noreturn]] void give_up(double waited_s, const std::string& refusals) const;
  std::string describe_vehicles(const std::vector<std::uint32_t>& ids) const;
  void announce_take_overs();
  double calc_longest_absence_s() const;

  WorkerPool& workers_;
  std::vector<PlantOfVehicles> plants_;
  const std::int64_t plant_steps_;  // per period
  bool is_step_published_ = false;
  OfferedAnswer offered_;  // reused for each answer
  std::uint64_t problems_version_ = 0;
  std::set<bus::PeerId> informed_;  // participants that have acknowledged parameters and status
  std::uint64_t looked_at_version_ = 0;  // version of the participants
  Clock::time_point look_time_;
  std::uint64_t roster_version_ = 0;
  Clock::time_point roster_time_;
  std::uint64_t roster_step_ = 0;
  std::optional<app::Wait> absence_wait_;
  std::optional<Clock::time_point> announced_absence_;       // start of the announced absence
  std::optional<ControllerAbsence::Action> absence_action_;  // the last one that was announced
  std::optional<Clock::time_point> recorder_report_time_;
};

}  // namespace sls::sim
