/// One run of the server, from its run_id to its end: waits for the participants, flies the
/// vehicles step by step, attends to operator and recorders. How a step gets its forces is what
/// lockstep_run.hpp and realtime_run.hpp add.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/app/wait.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/controller_absence.hpp"
#include "sim_server/endpoints.hpp"
#include "sim_server/participant_check.hpp"
#include "sim_server/plants/plant.hpp"
#include "sim_server/record_stream.hpp"
#include "sim_server/roster.hpp"
#include "sim_server/run_control.hpp"
#include "sim_server/status_board.hpp"
#include "sim_server/vehicle_flight.hpp"
#include "sim_server/worker_pool.hpp"

namespace sls::sim {

/// The assignment of a server.
struct Assignment {
  config::Scenario scenario;
  std::vector<std::uint32_t> vehicle_ids;  ///< of the scenario's, ascending; at least one
};

class Run {
 public:
  /// Announces run `run_id` of `assignment` in sls/parameters. It begins at rest if
  /// `begins_paused`.
  Run(Endpoints& endpoints, const Assignment& assignment, WorkerPool& workers, std::uint64_t run_id,
      bool begins_paused);
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

  /// @throws app::RunError if another server has the better claim to one of the vehicles.
  void check_claim() const;
  /// @throws app::RunError after a stop signal.
  static void check_stop();

 protected:
  using Clock = std::chrono::steady_clock;

  /// Step 0 is about to be published.
  virtual void begin() {}
  /// Publishes the states of the step in work, and decides the force of each vehicle; false
  /// if the operator ended the run.
  virtual bool exchange() = 0;
  /// Whether the step in work may be published as far as the recorders are concerned; false if the
  /// operator ended the run meanwhile.
  virtual bool wait_for_recorders() = 0;
  /// The roster was looked at again.
  virtual void roster_changed() {}
  /// The run was at rest for so long: nobody was asked for anything.
  virtual void note_rest(Clock::duration rest);

  /// Publishes the states of the step in work.
  void publish_states();

  // For both ways of stepping (run_answers.cpp).
  /// Judges the answers of one sample, and records those that are late; `is_early` where it came
  /// before the states of its step were published.
  void judge(const Commands& sample, const bus::PeerId& sender, bool is_early = false);
  /// A valid answer to a step that has gone by.
  virtual void note_late(VehicleFlight&, const OfferedAnswer&) {}
  VehicleFlight* find_vehicle(std::uint32_t id);
  /// True if every vehicle's answer to the step in work was accepted.
  bool are_all_accepted() const;
  /// True if a vehicle's last step was flown without an answer, and none has come since.
  bool is_anybody_absent() const;
  /// @throws app::RunError if a client's answer was refused and no other client answers.
  void check_refusals();
  /// Takes what was accepted, and says who takes over and who is back.
  void take_answers();
  /// Reports at intervals which participant is missing since when, also in sls/status. @throws
  /// app::RunError to give the run up.
  void attend_to_absence(ControllerAbsence::Action action);
  /// The controllers whose answers are awaited, in words.
  std::string name_awaited_controllers() const;

  /// Flies the period that begins with the step in work, and goes on to the next step.
  void advance();
  bool is_finished() const;

  /// Takes the operator's requests; true if one of them ended the run.
  bool attend_to_operator();
  /// Takes them, and waits while the operator holds the run; false if a request ended it.
  bool rest();
  void refresh_roster();
  bool is_roster_due() const;
  /// Status, stop signal, claim: what needs a look a few times a second.
  void do_housekeeping();
  /// True if the participants should be looked at before the next status is due.
  bool is_look_due() const;
  std::string describe_problem() const;

  Endpoints& endpoints_;
  const config::Scenario scenario_;
  const std::vector<std::uint32_t> vehicle_ids_;
  const std::uint64_t run_id_;

  std::vector<std::unique_ptr<VehicleFlight>> vehicles_;  // as vehicle_ids_
  SyncCounters link_;                                     // what concerns no vehicle alone
  StatusBoard board_;
  RunControl control_;
  Roster roster_;
  ParticipantCheck check_;
  RecordStream record_;
  bool are_recorders_given_up_ = false;     // policy go_on
  std::optional<Clock::time_point> began_;  // when step 0 was about to be published

 private:
  bool is_meant_for_another_server(const SimControl& request) const;
  bool wait_for_participants();
  bool fly();
  void measure(const PlantOfVehicles& group);
  /// Advances one plant over a period.
  void advance(PlantOfVehicles& group);
  /// Hands the step in work to the recorders, where its states were published.
  void record_step();
  void record_late(const VehicleFlight& vehicle, const OfferedAnswer& answer);
  void finish();
  void reset();
  void publish_end(RunPhase phase, const std::string& reason);
  void close_requests(const std::string& reason);
  void report_silent_recorder();
  /// Looks for what the participants do wrong.
  void look_for_problems();
  /// Says what the plants have to say of their vehicles.
  void announce_remarks();
  SyncCounters sum_counters() const;
  std::string describe_refusals(const VehicleFlight& vehicle) const;
  [[noreturn]] void give_up(double waited_s, const std::string& refusals) const;
  std::string describe_vehicles(const std::vector<std::uint32_t>& ids) const;
  void announce_take_overs();
  double calc_longest_absence_s() const;

  WorkerPool& workers_;
  std::vector<PlantOfVehicles> plants_;
  const std::int64_t plant_steps_;  // per period
  bool is_step_published_ = false;
  OfferedAnswer offered_;  // in work
  std::uint64_t problems_version_ = 0;
  std::uint64_t looked_at_version_ = 0;  // of the participants
  Clock::time_point look_time_;
  std::uint64_t roster_version_ = 0;
  Clock::time_point roster_time_;
  std::optional<app::Wait> absence_wait_;
  std::optional<Clock::time_point> announced_absence_;       // since when the one lasts that was
  std::optional<ControllerAbsence::Action> absence_action_;  // announced last
  std::optional<Clock::time_point> recorder_report_time_;
};

}  // namespace sls::sim
