/// A server's core without threads, clock and network: tests say what happens when, and see what it
/// does when. Times are ms after an arbitrary moment.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/core/server_core.hpp"
#include "tests/common/sync/samples.hpp"

namespace sls::sim {

using Lines = std::vector<std::string>;
using Phase = ServerCore::Phase;

class ServerRig : public Outputs, public Surroundings {
 public:
  static constexpr std::uint64_t kRunId = 500;

  /// One vehicle in lockstep that awaits one controller and no recorder; its mission lasts 1 s.
  static config::Scenario make_scenario() {
    auto scenario = config::load_scenario(SLS_SOURCE_DIR "/config/scenarios/short.yaml");
    scenario.sync.wait_for.recorders = 0;
    std::get<config::LeaveAfter>(scenario.mission.front().leave).duration_ns = 1'000'000'000;
    return scenario;
  }
  static config::Scenario make_realtime_scenario() {
    auto scenario = make_scenario();
    scenario.sync.mode = config::SyncMode::kRealtime;
    scenario.sync.real_time_factor = 1.0;
    return scenario;
  }

  explicit ServerRig(const config::Scenario& scenario = make_scenario(),
                     ServerCore::Start start = {kRunId, false, false})
      : force_z_(-(scenario.vehicle.quad_mass + scenario.vehicle.load_mass) *
                 scenario.vehicle.gravity) {
    std::vector<std::uint32_t> ids(scenario.vehicles.size());
    for (std::uint32_t i = 0; i < ids.size(); ++i) ids[i] = i;
    auto fleet =
        std::make_unique<Fleet>(scenario, ids, kRunId, [](std::size_t count, const auto& work) {
          for (std::size_t i = 0; i < count; ++i) work(i);
        });
    sha256_ = scenario.sha256;
    core_ = std::make_unique<ServerCore>(scenario, start, std::move(fleet), *this, now_);
  }

  // --- what happens ---

  /// Lets the time pass until `ms`, as the shell does.
  void wait_until(std::int64_t ms) {
    while (phase() != Phase::kEnded && core_->next_deadline() <= sync::at(ms)) {
      now_ = std::max(now_, core_->next_deadline());
      look();
    }
    now_ = std::max(now_, sync::at(ms));
    if (phase() != Phase::kEnded) look();
  }
  void wait(std::int64_t ms) { wait_until(this->ms() + ms); }

  /// The server was stopped until `ms`.
  void jump_to(std::int64_t ms) {
    now_ = sync::at(ms);
    look();
  }

  /// A client announces itself for all vehicles.
  void join(const std::string& name, int strength = 0, bool is_ready = true) {
    sync::Member& member = add(controllers_, name);
    member.announcement.scenario_sha256(sha256_);
    member.announcement.ready(is_ready);
    member.announcement.strength(strength);
    look();
  }
  /// A recorder announces that it has all rows up to `step`.
  void note_recorder(const std::string& name, std::int64_t step) {
    sync::Member& member = add(recorders_, name);
    member.announcement.role(ParticipantRole::ROLE_RECORDER);
    member.announcement.ready(true);
    member.announcement.last_complete_step(step);
    look();
  }
  /// The participant is not heard any more.
  void fall_silent(const std::string& name) { silent_[name] = now_; }
  void leave(const std::string& name) {
    const auto is_it = [&](const sync::Member& member) { return member.peer == peer(name); };
    for (auto* members : {&controllers_, &recorders_})
      members->erase(std::remove_if(members->begin(), members->end(), is_it), members->end());
    ++version_;
    look();
  }

  struct Answer {
    std::uint64_t step = 0;
    double more_force = 0.0;  ///< N, upwards
    bool is_last = false;     ///< the mission is over
    std::uint64_t run_id = kRunId;
    std::vector<std::uint32_t> vehicle_ids{0};
    std::uint64_t compute_ms = 0;
    model::ErrorCode error_code = model::ErrorCode::kNone;
    std::int64_t clock_ahead_ms = 0;
    std::int64_t queued_ms = 0;  ///< in the shell, until now
  };
  void answer(const std::string& name, const Answer& answer) {
    CommandSample sample;
    sample.sender = peer(name);
    const sync::Time arrived = now_ - std::chrono::milliseconds(answer.queued_ms);
    sample.arrived = {arrived, to_wall(arrived)};
    sample.written = sample.arrived.wall + std::chrono::milliseconds(answer.clock_ahead_ms);
    sample.run_id = answer.run_id;
    sample.step = answer.step;
    sample.client_name = name;
    for (const std::uint32_t id : answer.vehicle_ids) {
      OfferedAnswer& offered = sample.answers.emplace_back();
      offered.run_id = answer.run_id;
      offered.step = answer.step;
      offered.client_name = name;
      offered.vehicle_id = id;
      offered.answer.f_Q_W.z() = force_z_ - answer.more_force;
      offered.answer.mission =
          answer.is_last ? model::MissionPhase::kFinished : model::MissionPhase::kRunning;
      offered.answer.error_code = answer.error_code;
      offered.answer.memory.stage = answer.is_last ? 1 : 0;
      offered.answer.compute_time =
          std::chrono::duration<std::uint64_t, std::milli>(answer.compute_ms);
    }
    core_->on_commands(sample);
  }
  void answer(const std::string& name, std::uint64_t step) { answer(name, Answer{step}); }
  /// Answers each step at once, up to and including `last`.
  void fly_to(std::uint64_t last, const std::string& name = "pilot") {
    for (std::uint64_t step = this->step(); step <= last; ++step) {
      while (phase() == Phase::kAwaitingDue) {
        now_ = core_->next_deadline();
        look();
      }
      answer(name, step);
    }
  }

  void request(ControlAction action, std::uint64_t steps = 0, std::uint64_t run_id = kRunId) {
    SimControl request;
    request.run_id(run_id);
    request.request_id(++requests_);
    request.operator_name("anna@box");
    request.action(action);
    request.steps(steps);
    core_->on_request(request, *this, now_);
  }
  void stop(const std::string& signal) {
    stop_ = signal;
    look();
  }
  /// The middleware knows the controllers and their endpoints.
  void show_controllers() {
    for (sync::Member member : controllers_) {
      member.announcement.vehicle_ids({0});
      neighbourhood.participants.push_back(member);
      neighbourhood.command_writers[member.peer] = member.announcement.name().to_string();
      neighbourhood.state_readers.insert(member.peer);
    }
  }
  void fail(const std::string& reason) { core_->on_failure(reason, now_); }

  // Found by the shell when it looks around.
  std::vector<sync::Run> other_runs;
  bool is_on_this_machine = true;
  bool knows_every_claim = true;
  Neighbourhood neighbourhood;
  bool repeats_announcements = true;            ///< those who join from now on
  std::chrono::nanoseconds announcement_age{};  ///< of all controllers, by their clocks
  std::string problem;                          ///< that the middleware has found
  bool is_queue_full = false;                   ///< of records
  std::uint64_t written = 0;                    ///< records
  std::uint64_t lost_samples = 0;
  std::uint64_t missed_deadlines = 0;
  std::optional<std::chrono::nanoseconds> lifespan;
  std::uint64_t failing_states = 0;  ///< number of writes of states that the middleware refuses

  // --- what it did ---

  ServerCore& core() { return *core_; }
  Phase phase() const { return core_->phase(); }
  std::uint64_t step() const { return step_; }
  std::int64_t ms() const {
    return std::chrono::duration_cast<std::chrono::milliseconds>(now_ - sync::at(0)).count();
  }
  /// "20: state 0" or "40: state 0 again", since the last call.
  Lines take_states() { return std::exchange(states_, {}); }
  /// "1000: waiting for: …", since the last call.
  Lines take_log() { return std::exchange(log_, {}); }
  /// "0 accepted", since the last call; also "late 3" and "end".
  Lines take_records() { return std::exchange(records_, {}); }
  const std::vector<SimStatus>& statuses() const { return statuses_; }
  const SimStatus& status() const { return statuses_.back(); }
  const std::vector<SimControlReply>& replies() const { return replies_; }
  bool is_lifespan_ignored() const { return is_lifespan_ignored_; }

 private:
  static bus::PeerId peer(const std::string& name) {
    bus::PeerId peer{};
    for (std::size_t i = 0; i < std::min(name.size(), peer.bytes.size()); ++i)
      peer.bytes[i] = static_cast<std::uint8_t>(name[i]);
    return peer;
  }
  static std::chrono::system_clock::time_point to_wall(sync::Time time) {
    return std::chrono::system_clock::time_point(
        std::chrono::duration_cast<std::chrono::system_clock::duration>(time.time_since_epoch()));
  }
  sync::Member& add(std::vector<sync::Member>& members, const std::string& name) {
    ++version_;
    silent_.erase(name);
    for (sync::Member& member : members)
      if (member.peer == peer(name)) return member;
    sync::Member& member = members.emplace_back();
    member.peer = peer(name);
    member.announcement.run_id(kRunId);
    member.announcement.name(name);
    member.announcement.host("box");
    member.announcement.contract_sha256(bus::kContractSha256);
    member.announcement.last_complete_step(-1);
    member.announcement.vehicle_ids({0, 1});
    member.ready_since = now_;
    member.is_repeated = repeats_announcements;
    return member;
  }
  void look() {
    core_->on_wake(
        *this, [] {}, [this] { return now_; });
  }
  std::string stamp(const std::string& text) const { return fmt::format("{}: {}", ms(), text); }

  // Outputs
  Moment send_states(const Fleet& fleet) override {
    step_ = fleet.step();
    if (failing_states > 0 && failing_states-- > 0) throw std::runtime_error("write refused");
    states_.push_back(stamp(fmt::format("state {}", fleet.step())));
    return {now_, to_wall(now_)};
  }
  void resend_states(const Fleet& fleet,
                     const std::function<bool(std::size_t)>& is_wanted) override {
    std::string vehicles;
    for (std::size_t i = 0; i < fleet.vehicles().size(); ++i)
      if (fleet.vehicles().size() > 1 && is_wanted(i)) vehicles += fmt::format(" {}", i);
    states_.push_back(stamp(fmt::format("state {} again{}", fleet.step(), vehicles)));
  }
  void record_step(const Fleet& fleet) override {
    for (const auto& vehicle : fleet.vehicles()) {
      const model::StepRecord& record = vehicle->record();
      static const char* const kKinds[] = {"none", "accepted", "held", "fail-safe", "refused"};
      records_.push_back(
          fmt::format("{} {}", record.step, kKinds[static_cast<std::size_t>(record.kind)]));
    }
  }
  void record_late(const Vehicle&, const OfferedAnswer& answer) override {
    records_.push_back(fmt::format("late {}", answer.step));
  }
  bool is_record_full() const override { return is_queue_full; }
  std::uint64_t lost() const override { return lost_samples; }
  void flush_records() override { records_.push_back("flush"); }
  void end_records() override { records_.push_back("end"); }
  void send(const SimStatus& status) override { statuses_.push_back(status); }
  void send(const SimControlReply& reply) override { replies_.push_back(reply); }
  void log(sync::Line line) override { log_.push_back(stamp(line.text)); }
  void show_progress(std::string text) override { log_.push_back(stamp(text)); }
  void begin_flight() override { log_.push_back(stamp("flight begins")); }
  void ignore_lifespan(bool is_ignored) override { is_lifespan_ignored_ = is_ignored; }

  // Surroundings
  std::uint64_t members_version() const override { return version_; }
  std::vector<sync::Member> find_members(ParticipantRole role, std::uint64_t) const override {
    auto members = role == ParticipantRole::ROLE_CONTROLLER ? controllers_ : recorders_;
    for (sync::Member& member : members) {
      const auto silent = silent_.find(member.announcement.name().to_string());
      member.heard = silent == silent_.end() ? now_ : silent->second;
      member.age = announcement_age;
    }
    return members;
  }
  std::vector<sync::Run> find_other_runs() const override { return other_runs; }
  bool is_known_elsewhere(std::uint64_t run_id) const override {
    return std::any_of(other_runs.begin(), other_runs.end(),
                       [&](const sync::Run& run) { return run.parameters.run_id() == run_id; });
  }
  bool stays_on_this_machine() const override { return is_on_this_machine; }
  bool has_heard_every_claim() const override { return knows_every_claim; }
  std::uint64_t problems_version() const override { return problem.size(); }
  Neighbourhood find_neighbours() override {
    Neighbourhood seen = neighbourhood;
    for (sync::Member& member : seen.participants) member.heard = now_;
    return seen;
  }
  std::string replace_problems(const std::map<std::string, std::string>& found) override {
    return found.empty() ? problem : found.begin()->second;
  }
  std::string describe_isolation() const override { return ""; }
  Queues queues() const override { return {written, 10'000, missed_deadlines}; }
  std::optional<std::chrono::nanoseconds> command_lifespan() const override { return lifespan; }
  std::string stop_signal() const override { return stop_; }

  const double force_z_;
  std::string sha256_;
  sync::Time now_ = sync::at(0);
  std::vector<sync::Member> controllers_, recorders_;
  std::map<std::string, sync::Time> silent_;
  std::uint64_t version_ = 1;
  std::uint64_t requests_ = 0;
  std::string stop_;
  std::uint64_t step_ = 0;
  Lines states_, log_, records_;
  std::vector<SimStatus> statuses_;
  std::vector<SimControlReply> replies_;
  bool is_lifespan_ignored_ = false;
  std::unique_ptr<ServerCore> core_;
};

}  // namespace sls::sim
