/// The rules of a run in flight, judged by an observer who knows what has arrived at its server:
/// who flies, when another client takes over, what is sent again, the policies, the operator.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/bus/peer.hpp"
#include "common/config/scenario.hpp"
#include "common/model/step_record.hpp"
#include "sim_server/core/answers/judgement.hpp"
#include "sls.h"
#include "worlds/host.hpp"
#include "worlds/request_check.hpp"
#include "worlds/status_check.hpp"

namespace sls::worlds {

class Program;

class FlightWatch {
 public:
  /// Drift of clocks, and the wake-ups of a program that has its processor.
  static constexpr Instant kSlack = std::chrono::milliseconds(20);

  /// Of run `run_id` of `server`. `find`: called with each broken rule.
  FlightWatch(const config::Scenario& scenario, std::uint64_t run_id,
              std::vector<std::uint32_t> vehicle_ids, const Program& server,
              std::function<void(std::string)> find);

  /// A run before it, of the same server: participants that it knows announce themselves once.
  void follow(const FlightWatch& before) {
    peers_.insert(before.peers_.begin(), before.peers_.end());
  }

  // --- arrives at the server ---

  void on_member(const Participant& message, const bus::PeerId& peer, const Process& sender,
                 Instant now);
  void on_answers(const Commands& sample, const Process& sender, Instant now);
  void on_request(ControlAction action);

  // --- the server does ---

  void on_published(std::uint64_t step, Instant now);
  void on_resent(Instant now);
  void on_recorded(const std::vector<model::StepRecord>& records, Instant now);
  /// An answer of `vehicle` to an earlier step counts from now on, unless a newer one does.
  void on_late(std::uint32_t vehicle, std::uint64_t step) {
    if (note_newest(vehicle, step)) lacking_.erase(vehicle);
  }
  /// A status of a flight that runs, not paused.
  void on_running(Instant now);
  /// The run fails with `reason`. False if it is none of those that participants cause.
  bool on_failed(const std::string& reason, Instant now);
  const config::Sync& sync() const { return sync_; }
  /// When a recorder's announcement came last; 0 if none did.
  Instant find_heard(const std::string& recorder) const {
    const auto known = recorders_.find(recorder);
    return known == recorders_.end() ? Instant(0) : known->second.heard;
  }
  void on_interrupted();
  void on_status(const SimStatus& status) { status_.on_status(status); }
  /// The server says `line`.
  void on_line(const std::string& line, Instant now);
  /// What operators ask of it.
  RequestCheck& requests() { return requests_; }
  const RequestCheck& requests() const { return requests_; }
  /// Its process was stopped or continued, or became slower or faster: it may be late with all.
  void on_disturbed();

 private:
  /// A participant, as the server hears it.
  struct Heard {
    const Process* process = nullptr;
    Instant ready{0};        // its first announcement that says so; 0: none does
    Instant heard{0};        // its last sample
    Instant heard_awake{0};  // the same in awake time of the server
    Instant back{0};         // the first one after a long silence

    void hear(Instant now, Instant awake);
  };
  struct Client : Heard {
    std::tuple<std::int32_t, std::string, bus::PeerId> order;  // the first one is the strongest
    std::vector<std::uint32_t> vehicle_ids;
    bool is_ready = false;
    Instant left{0};  // its first one after that which does not
    std::uint64_t answered_step = 0;
    std::map<std::uint32_t, Instant> answers;  // the first ones to that step, by vehicle
    std::map<std::uint32_t, Instant> refused;  // the first defective ones to it
    bool has_erred = false;                    // one of its answers was defective

    bool has_answered(std::uint32_t vehicle, std::uint64_t step) const {
      return answered_step == step && answers.count(vehicle) > 0;
    }
    bool is_refused(std::uint32_t vehicle, std::uint64_t step) const {
      return answered_step == step && refused.count(vehicle) > 0;
    }
  };
  struct Recorder : Heard {
    bus::PeerId peer;
  };
  /// Steps in a row that a vehicle was flown without an answer.
  struct Lacking {
    Instant since{0};      // awake time of the server, without pauses and waits for recorders
    Instant published{0};  // the first one of them, awake time of the server
    std::uint64_t held = 0;
  };

  /// True if no answer of `vehicle` to this or a later step is known.
  bool note_newest(std::uint32_t vehicle, std::uint64_t step) {
    const auto [newest, is_first] = newest_.try_emplace(vehicle, step);
    const bool is_newer = is_first || step > newest->second;
    if (is_newer) newest->second = step;
    return is_newer;
  }
  bool is_unclear() const;
  bool is_disturbed() const;
  bool is_lockstep() const { return sync_.mode == config::SyncMode::kLockstep; }
  bool is_sound(const ControlCommand& command, std::uint64_t step) const;
  void check_take_over(const std::vector<model::StepRecord>& records, Instant now);
  std::vector<std::pair<std::string, const Client&>> list_stronger(const Client& flyer,
                                                                   std::uint32_t vehicle) const;
  std::optional<Instant> check_flyer(const model::StepRecord& record, Instant now);
  void check_policy(const model::StepRecord& record);
  void check_gap(Instant now);
  void check_due(std::uint64_t step, Instant now);

  void check_start(const std::string& reason, Instant now);
  void check_wait(const std::string& reason, const std::string& waited, bool is_refused,
                  Instant now);
  void check_absence(const std::string& reason, const std::string& named, Instant now);
  void check_early(const std::string& reason, Instant since, double deadline_s);
  bool is_present(const Heard& participant, Instant now) const;
  bool is_there(const Client& client, Instant now) const;
  int count_recorders(Instant now) const;
  std::vector<const Client*> find_clients(const std::string& announced_name) const;

  const Program& server_;
  const config::Sync& sync_;
  const sim::AnswerLimits limits_;
  const std::string& scenario_sha256_;
  const std::uint64_t run_id_;
  const std::vector<std::uint32_t> vehicle_ids_;
  const Instant began_;  // awake time of the server
  const std::function<void(std::string)> find_;
  std::map<std::string, Client> clients_;        // by name of the process
  std::map<std::string, Recorder> recorders_;    // likewise
  std::set<std::string> rightful_;               // ready for this run, at any time
  std::map<std::uint32_t, std::string> flyers_;  // of the last step, by vehicle
  std::map<std::uint32_t, Lacking> lacking_;
  std::map<std::uint32_t, std::uint64_t> newest_;  // steps with answers, by vehicle
  bool has_begun_ = false;
  std::uint64_t step_ = 0;
  Instant published_{0};
  Instant published_awake_{0};   // the same in awake time of the server
  std::optional<Instant> sent_;  // the last state of an open step
  bool has_libraries_ = false;
  std::set<bus::PeerId> peers_;  // that announced themselves as controllers
  bool is_disturbed_ = false;    // since the last step was published
  Instant disturbed_{0};         // the last time, awake time of the server
  StatusCheck status_;
  RequestCheck requests_;
  std::optional<std::pair<std::uint64_t, Instant>> schedule_;  // the first step and when it left
  Instant recorded_awake_{0};  // the last step, in awake time of the server
  std::optional<Instant> interrupted_, stop_requested_, paused_;  // awake time of the server
};

}  // namespace sls::worlds
