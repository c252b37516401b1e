/// The properties that hold in every world: docs/worlds.md. The programs say what they do; the
/// properties know more than each of them.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/model/step_record.hpp"
#include "common/sync/servers.hpp"
#include "recorder/core/recording_core.hpp"
#include "worlds/flight_watch.hpp"
#include "worlds/network.hpp"
#include "worlds/plan.hpp"
#include "worlds/timeline.hpp"
#include "worlds/trace.hpp"

namespace sls::worlds {

struct FlownScenario;
class Program;

/// The rows that a recording holds on the simulated disk, and what its manifest claims.
struct StoredRecording {
  /// What the rows of a step say of its answer.
  struct Answer {
    std::uint64_t hash = 0;
    bool is_unanswered = false;  ///< flown with a held answer or the fail-safe force
    bool has_command = false, has_reference = false;
  };
  struct Rows {
    std::vector<std::uint64_t> steps;   ///< as they were written
    std::vector<std::uint64_t> hashes;  ///< of the rows
    std::vector<Answer> answers;        ///< likewise; only of a recorder without a folder
  };
  std::uint64_t run_id = 0;
  bool is_closed = false;
  record::Claims claims;               ///< of the last manifest
  std::string certificate;             ///< of a closed one
  std::vector<std::string> damages;    ///< where files are no rows, or other than the manifest says
  std::map<std::uint32_t, Rows> rows;  ///< by vehicle
  // What came to be written; only of a recorder without a folder.
  std::set<std::uint64_t> statuses;  ///< their indices
  std::optional<SimStatus> status;   ///< the last one
};

/// The course of a finished flight.
struct FlightSummary {
  double duration_s = 0;     ///< from the first state to the end, simulated
  double worst_error_m = 0;  ///< of the load, from its reference
  std::uint64_t take_overs = 0;
  std::uint64_t late = 0;  ///< steps flown without a fresh answer
};

/// The content of a row that no late answer changes: the state, and the answer.
std::uint64_t hash_row(const model::StepRecord& record);
std::uint64_t hash_answer(const model::StepRecord& record);

class Properties {
 public:
  Properties(const Timeline& timeline, Trace& trace) : timeline_(timeline), trace_(trace) {}

  // --- what the programs do ---

  void on_run(const Program& server, std::uint64_t run_id, const Parameters& parameters,
              const config::Scenario& scenario);
  /// The judge of a run in flight, for its server to tell what arrives and what it sends again.
  FlightWatch& flight(std::uint64_t run_id) { return *runs_.at(run_id).flight; }
  /// A server ends because another one has its vehicles.
  void on_yielded(const Program& server, std::uint64_t run_id, const Network& network);
  /// States of a step leave for the first time.
  void on_published(std::uint64_t run_id, std::uint64_t step, const config::WaitFor& expected);
  void on_recorded(std::uint64_t run_id, const std::vector<model::StepRecord>& records);
  /// A late answer to `step` is recorded.
  void on_late(std::uint64_t run_id, std::uint32_t vehicle, std::uint64_t step) {
    runs_[run_id].has_late = true;
    runs_[run_id].late[vehicle].insert(step);
    runs_[run_id].flight->on_late(vehicle, step);
  }
  void on_status(const SimStatus& status, const Network& network);
  /// `reason`: why it failed.
  void on_run_end(std::uint64_t run_id, bool is_finished, std::string certificate,
                  const std::string& reason, const Network& network);
  /// `heard`: what the program knows of servers.
  void on_announced(const Program& program, const Participant& message, const sync::Servers& heard);
  void on_request(const SimControl& request) { requests_[request.request_id()] = request.run_id(); }
  /// The program finds a participant that writes as a server and claims nothing.
  void on_unclaimed(const Program& program, const Peer& writer, const Network& network);
  /// `step`: the last complete one, as announced; `newest`: the last one received, by vehicle.
  void on_progress(const Program& recorder, std::int64_t step,
                   const std::map<std::uint32_t, std::int64_t>& newest);
  void on_replied(const Program& server, std::uint64_t request_id, const Network& network);
  void on_interrupted(const Program& program);
  void on_killed(const Program& program);
  void on_stopped(const Program& program);
  void on_continued(const Program& program);
  /// A program prints `text`. `heard`: what it knows of servers.
  void on_line(const Program& program, const std::string& text, const sync::Servers& heard);
  /// A program ends by itself.
  void on_exit(const Program& program);
  /// Its process was stopped or continued, or became slower or faster.
  void on_disturbed(const Program& program);

  /// At the end of the world.
  void check(const Plan& plan, const std::vector<std::unique_ptr<Program>>& programs,
             const FlownScenario& flown);

  const std::vector<std::string>& findings() const { return findings_; }
  std::uint64_t steps() const { return steps_; }
  bool is_any_finished() const;
  /// Those that were finished.
  std::vector<FlightSummary> summarise_flights() const;

 private:
  /// A run as the world saw it.
  struct Run {
    const Program* server = nullptr;
    std::vector<std::uint32_t> vehicle_ids;
    std::string scenario_sha256;
    std::set<std::string> ready;                              // clients that have announced it
    std::map<std::uint32_t, std::set<std::string>> ready_of;  // the same, by vehicle
    std::set<std::string> recorders;                          // the same
    std::set<std::string> wrong;                              // clients that make mistakes
    std::map<std::string, Instant> ready_since, done;         // recorders
    std::unique_ptr<FlightWatch> flight;
    std::map<std::uint32_t, std::vector<std::uint64_t>> rows;     // hashes, by vehicle and step
    std::map<std::uint32_t, std::vector<std::uint64_t>> answers;  // the same
    std::map<std::uint32_t, std::set<std::uint64_t>> late;        // steps with late answers
    std::map<std::uint32_t, model::StepRecord> last;
    bool is_exact = true;  // each force answers its own state
    bool has_late = false;
    bool has_mistakes = false;  // in answers that were accepted
    bool has_ended = false;
    Instant ended{0};
    bool is_finished = false;
    std::string certificate;
    std::string failure;  // why it failed
    bool is_failure_judged = false;
    std::string timing;
    RunPhase phase = RunPhase::PHASE_WAITING;
    int furthest = 0;         // progress of its furthest phase (sync::calc_progress)
    bool has_status = false;  // its claim is settled
    bool is_realtime = false;
    bool waits_for_recorders = false;
    bool has_faulty_forces = false;  // the scenario disturbs them
    bool is_match_late = false;
    Instant phase_since{0};
    bool was_paused = false;
    std::optional<Instant> published;  // the last step
    Instant disturbed{0};              // its server was stopped, continued, slowed down or let go
    std::optional<Instant> began;      // the first step
    FlightSummary summary;
    Instant named{-1};  // the last status with a reason
    bool is_stall_found = false;
  };

  struct Announced {
    bool is_honest = false;  // makes no mistakes on purpose
    Instant since{0};
  };

  void find(std::string finding);
  /// Its server could not say all that it wanted.
  static bool has_been_refused(const Run& run);
  void check_problem(const SimStatus& status);
  bool is_of_other_run(const std::string& run_id, const SimStatus& status) const;
  void check_announcement(const Program& program, const Participant& message);
  void check_join(const Program& program, std::uint64_t run_id, std::uint64_t left,
                  const sync::Servers& heard);
  int count_living(const Run& run, const std::set<std::string>& names) const;
  void check_recorders(const Run& run, std::uint64_t step, const config::WaitFor& expected);
  void check_stall(Run& run, std::uint64_t run_id);
  void check_rivals(const Run& run, const Network& network);
  void check_applied(const model::StepRecord& before, const model::StepRecord& record);
  void check_recording(const Program& program, const StoredRecording& recording,
                       const FlownScenario& flown, Promise promise);
  /// All rows of the run are there.
  void check_whole(const Program& program, const StoredRecording& recording, const Run& run);
  void check_rows(const Program& program, const StoredRecording& recording, const Run& run);
  void check_claims(const Program& program, const StoredRecording& recording, const Run& run);
  void check_answers(const Program& program, const StoredRecording& recording, const Run& run);
  void check_failure(const Program& server, const FlownScenario& flown);
  void check_exit(const Program& program);
  void check_client_end(const Program& client);
  void check_silence(const Program& program, std::uint64_t run_id, double said_s);
  void check_begin(std::uint64_t run_id, const Run& run, const FlownScenario& flown);
  Instant find_ready(const Run& run, const std::set<std::string>& names, int count) const;
  void check_end(const Program& server, const std::vector<std::unique_ptr<Program>>& programs);

  const Timeline& timeline_;
  Trace& trace_;
  std::map<std::uint64_t, Run> runs_;
  std::map<std::string, Instant> killed_, stopped_, continued_;  // by name
  std::map<std::string, std::uint64_t> joined_;                  // last runs
  std::map<std::string, Announced> announced_;                   // by announced name
  bool has_libraries_ = false;                                   // of clients
  std::set<std::string> too_late_;                               // that joined a run after its end
  std::map<std::pair<const Program*, const Program*>, Instant> rivals_;  // fly together since
  bool is_overloaded_ = false;  // a flight in real time failed beside a full link
  std::map<std::uint64_t, std::uint64_t> requests_;  // runs, by number of the request
  std::uint64_t steps_ = 0;
  std::vector<std::string> findings_;
};

}  // namespace sls::worlds
