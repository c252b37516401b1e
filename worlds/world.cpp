#include "worlds/world.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <deque>
#include <set>
#include <utility>

#include "worlds/client_program.hpp"
#include "worlds/foreign_program.hpp"
#include "worlds/operator_program.hpp"
#include "worlds/properties.hpp"
#include "worlds/recorder_program.hpp"
#include "worlds/server_program.hpp"

namespace sls::worlds {
namespace {

using namespace std::chrono_literals;
using Kind = Fault::Kind;

/// After the faults every program ends within this: a flight, and the patience of all waits, one
/// after another.
Instant calc_patience(const FlownScenario& flown, const Plan& plan) {
  const config::Sync& sync = flown.scenario.sync;
  const double wait_s = std::max({sync.wait_for.timeout_s, sync.wait.controller.deadline_s,
                                  sync.wait.recorder.deadline_s, sync.wait.server_deadline_s});
  const double step_s = static_cast<double>(sync.period_ns) * 1e-9 / sync.real_time_factor +
                        sync::to_seconds(2 * (plan.link.delay + plan.link.jitter));
  // A client that breaks may keep a stage until it times out.
  constexpr std::uint64_t kStepsOfStage = 16'000;
  const bool is_long = std::any_of(plan.programs.begin(), plan.programs.end(),
                                   [](const auto& program) { return program.breaks_at; });
  const double flight_s = static_cast<double>(is_long ? kStepsOfStage : flown.last_step) * step_s;
  return 110s + sync::to_duration(4 * wait_s + 2 * flight_s);
}

class World {
 public:
  World(const Plan& plan, const std::vector<FlownScenario>& scenarios,
        const std::filesystem::path& folder, bool keeps_trace)
      : plan_(plan), folder_(folder), setting_(plan.seed, keeps_trace) {
    setting_.flown = &scenarios[plan.scenario];
    setting_.folder = folder.string();
    setting_.is_one_machine = plan.hosts == 1;
    setting_.network.set_record_history(plan.record_history);
    setting_.network.set_lease(plan.lease);
    make_hosts();
    for (std::size_t i = 0; i < plan.programs.size(); ++i) {
      current_.push_back(nullptr);
      ++pending_starts_;
      setting_.timeline.at(plan.programs[i].start, [this, i] { start(i); });
    }
    setting_.are_all_others_done = [this] { return are_done(); };
    setting_.on_step = [this](std::uint64_t step) { on_step(step); };
    for (const Fault& fault : plan.faults)
      if (!fault.step) setting_.timeline.at(fault.at, [this, &fault] { begin(fault); });
    setting_.timeline.at(plan.healed, [this] { heal(); });
  }

  Verdict fly() {
    const Instant end = plan_.healed + calc_patience(*setting_.flown, plan_);
    while (setting_.timeline.step(end)) {
      if (is_over()) break;
    }
    setting_.properties.check(plan_, programs_, *setting_.flown);
    return make_verdict();
  }

 private:
  void make_hosts() {
    Random random = setting_.random.split();
    for (std::size_t i = 0; i < plan_.hosts; ++i) {
      const auto wall_offset = sync::to_duration(random.between(-1, 1) * plan_.wall_offset_s);
      hosts_.emplace_back(setting_.timeline, fmt::format("host-{}", i),
                          std::chrono::seconds(random.integer(100, 1'000'000)),
                          random.between(-1, 1) * plan_.drift, wall_offset);
    }
    for (Host& from : hosts_)
      for (Host& to : hosts_)
        setting_.network.link(from, to) =
            &from == &to ? Link{10us, 20us, 0, 0, Instant(0), false} : plan_.link;
  }

  void start(std::size_t index) {
    --pending_starts_;
    const PlannedProgram& planned = plan_.programs[index];
    Host& host = hosts_[planned.host];
    std::string name = name_program(plan_, index);
    if (current_[index]) name += fmt::format(".{}", ++restarts_);
    std::unique_ptr<Program> program;
    if (planned.role == Role::kServer)
      program = std::make_unique<ServerProgram>(setting_, host, name, planned.vehicle_ids);
    else if (planned.role == Role::kClient)
      program = std::make_unique<ClientProgram>(
          setting_, host, name,
          ClientProgram::Options{planned.vehicle_ids, planned.strength, planned.follows_servers,
                                 planned.has_other_scenario, planned.is_sloppy, planned.delay,
                                 planned.is_early, planned.breaks_at, planned.announces_once,
                                 planned.announced_name, planned.has_library, planned.says_done});
    else if (planned.role == Role::kForeign)
      program = std::make_unique<ForeignProgram>(
          setting_, host, name, ForeignProgram::Options{planned.is_wild, planned.is_crowd});
    else
      program = std::make_unique<RecorderProgram>(
          setting_, host, name,
          RecorderProgram::Options{choose_folder(index), planned.vehicle_ids.front(),
                                   planned.resumes, planned.follows_servers, planned.queue,
                                   planned.delay});
    current_[index] = program.get();
    programs_.push_back(std::move(program));
    setting_.trace.add(setting_.timeline.now(), name, "starts");
    current_[index]->start();
  }

  /// A recorder that does not go on with the recording of a killed one needs a new folder.
  std::filesystem::path choose_folder(std::size_t index) const {
    if (!plan_.has_files) return {};
    const std::string name = name_program(plan_, index);
    return folder_ / (plan_.programs[index].resumes ? name : fmt::format("{}.{}", name, restarts_));
  }

  /// True if all programs have ended but foreign ones, which wait for it.
  bool are_done() const {
    if (setting_.timeline.now() < plan_.healed || pending_starts_ > 0) return false;
    return std::all_of(programs_.begin(), programs_.end(), [](const auto& program) {
      return program->process().has_ended() || program->role() == Role::kForeign;
    });
  }
  bool is_over() const {
    return are_done() && std::all_of(programs_.begin(), programs_.end(), [](const auto& program) {
             return program->process().has_ended();
           });
  }

  // --- faults ---

  void on_step(std::uint64_t step) {
    if (setting_.timeline.now() >= plan_.healed) return;
    // Once, although a further run has this step, too.
    for (const Fault& fault : plan_.faults)
      if (fault.step == step && begun_.insert(&fault).second)
        setting_.timeline.after(fault.at, [this, &fault] { begin(fault); });
  }

  void begin(const Fault& fault) {
    if (setting_.timeline.now() >= plan_.healed) return;
    ++begun_faults_;
    setting_.trace.add(setting_.timeline.now(), "FAULT", describe(fault));
    switch (fault.kind) {
      case Kind::kKill:
      case Kind::kPowerCut:
        return kill(fault);
      case Kind::kStop:
        return stop(fault);
      case Kind::kInterrupt:
        if (Program* program = current_[fault.target]) program->interrupt();
        return;
      case Kind::kCut:
      case Kind::kIsolate:
      case Kind::kPartition:
        return cut(fault);
      case Kind::kLoss:
        extra_loss_ = fault.value;
        set_links();
        return setting_.timeline.after(fault.duration, [this] {
          extra_loss_ = 0;
          set_links();
        });
      case Kind::kClog:
        clog_ = calc_packet_time(fault.value);
        set_links();
        return setting_.timeline.after(fault.duration, [this] {
          clog_ = Instant(0);
          set_links();
        });
      case Kind::kStall:
        stalled_until_ = std::min(setting_.timeline.now() + fault.duration, plan_.healed);
        return set_links();
      case Kind::kSlow:
        if (Program* program = current_[fault.target]) {
          program->set_slowness(sync::to_duration(fault.value));
          setting_.timeline.after(fault.duration, [program] { program->set_slowness(Instant(0)); });
        }
        return;
      case Kind::kClock:
        return hosts_[fault.target].set_wall_clock(sync::to_duration(fault.value));
      case Kind::kDiskFull:
        return fill_disk(fault);
      case Kind::kRequest:
        return request(fault);
      case Kind::kRefuse:
      case Kind::kBlock:
        return hinder_writes(fault);
    }
  }

  void fill_disk(const Fault& fault) {
    Program* program = current_[fault.target];
    if (!program || program->role() != Role::kRecorder) return;
    auto* recorder = static_cast<RecorderProgram*>(program);
    recorder->set_disk_full(true);
    setting_.timeline.after(fault.duration, [recorder] { recorder->set_disk_full(false); });
  }

  void hinder_writes(const Fault& fault) {
    auto* server = static_cast<ServerProgram*>(current_[fault.target]);
    if (!server) return;
    const auto hinder =
        fault.kind == Kind::kRefuse ? &ServerProgram::refuse_writes : &ServerProgram::block_records;
    (server->*hinder)(true);
    setting_.timeline.after(fault.duration, [server, hinder] { (server->*hinder)(false); });
  }

  void kill(const Fault& fault) {
    Program* program = current_[fault.target];
    if (!program || program->process().has_ended()) return;
    program->kill();
    if (fault.kind == Kind::kPowerCut && program->role() == Role::kRecorder)
      lose_unsynced(static_cast<RecorderProgram*>(program)->folder(), random_);
    if (fault.duration.count() == 0) return;
    ++pending_starts_;
    setting_.timeline.after(fault.duration, [this, index = fault.target] { start(index); });
  }

  void stop(const Fault& fault) {
    Program* program = current_[fault.target];
    if (!program || program->process().is_stopped()) return;
    program->stop();
    const Instant until = std::min(setting_.timeline.now() + fault.duration, plan_.healed);
    setting_.timeline.at(until, [program] { program->go_on(); });
  }

  void cut(const Fault& fault) {
    const auto set = [this, &fault](int change) {
      for (std::size_t from = 0; from < hosts_.size(); ++from)
        for (std::size_t to = 0; to < hosts_.size(); ++to) {
          if (from == to) continue;
          const bool is_it =
              fault.kind == Kind::kPartition ||
              (fault.kind == Kind::kIsolate && (from == fault.target || to == fault.target)) ||
              (fault.kind == Kind::kCut && from == fault.target && to == fault.other);
          if (is_it) cuts_[{from, to}] += change;
        }
      set_links();
    };
    set(1);
    setting_.timeline.after(fault.duration, [set] { set(-1); });
  }

  void set_links() {
    const bool is_healed = setting_.timeline.now() >= plan_.healed;
    for (std::size_t from = 0; from < hosts_.size(); ++from)
      for (std::size_t to = 0; to < hosts_.size(); ++to) {
        if (from == to) continue;
        Link& link = setting_.network.link(hosts_[from], hosts_[to]);
        link.loss = is_healed ? 0 : std::max(plan_.link.loss, extra_loss_);
        link.packet_time = is_healed ? Instant(0) : std::max(plan_.link.packet_time, clog_);
        link.stalled_until = stalled_until_;
        const bool was_cut = std::exchange(link.is_cut, !is_healed && cuts_[{from, to}] > 0);
        if (was_cut && !link.is_cut) link.mended = setting_.timeline.now();
      }
  }

  void request(const Fault& fault) {
    auto* server = static_cast<ServerProgram*>(current_[fault.target]);
    if (!server || server->process().has_ended()) return;
    if (!operator_) {
      operator_ = std::make_unique<OperatorProgram>(setting_, hosts_.front(), "operator");
      operator_->start();
    }
    operator_->request(server->run_id(), static_cast<ControlAction>(fault.other),
                       static_cast<std::uint64_t>(fault.value));
    // A person who pauses a flight goes on with it.
    const auto action = static_cast<ControlAction>(fault.other);
    if (action != ControlAction::ACTION_PAUSE && action != ControlAction::ACTION_STEP) return;
    const Instant until = setting_.timeline.now() + fault.duration;
    setting_.timeline.at(plan_.promise == Promise::kNone ? std::max(plan_.healed, until) : until,
                         [this, &fault] { resume(fault.target); });
  }

  /// Until it is done: the run may be another one, after a reset.
  void resume(std::size_t index) {
    auto* server = static_cast<ServerProgram*>(current_[index]);
    if (!server || server->process().has_ended()) return;
    operator_->request(server->run_id(), ControlAction::ACTION_RESUME, 0);
    setting_.timeline.after(500ms, [this, index] { resume(index); });
  }

  void heal() {
    setting_.trace.add(setting_.timeline.now(), "FAULT", "all faults are over");
    set_links();
    for (const auto& program : programs_) program->set_slowness(Instant(0));
  }

  Verdict make_verdict() {
    Verdict verdict;
    verdict.findings = setting_.properties.findings();
    setting_.trace.add(setting_.timeline.count());
    verdict.hash = setting_.trace.hash();
    verdict.trace = setting_.trace.lines();
    verdict.simulated_s = sync::to_seconds(setting_.timeline.now());
    verdict.events = setting_.timeline.count();
    verdict.begun_faults = begun_faults_;
    verdict.steps = setting_.properties.steps();
    verdict.flights = setting_.properties.summarise_flights();
    for (const auto& program : programs_)
      if (program->role() == Role::kRecorder)
        verdict.complete += static_cast<const RecorderProgram&>(*program).is_complete();
    return verdict;
  }

  const Plan& plan_;
  const std::filesystem::path folder_;
  Setting setting_;
  std::deque<Host> hosts_;
  std::vector<std::unique_ptr<Program>> programs_;  // also those that have ended
  std::vector<Program*> current_;                   // as plan_.programs
  std::unique_ptr<OperatorProgram> operator_;       // once a request is sent
  Random random_ = setting_.random.split();
  std::size_t pending_starts_ = 0;
  int restarts_ = 0;
  std::uint64_t begun_faults_ = 0;
  double extra_loss_ = 0;
  Instant clog_{0};  // time of a packet
  Instant stalled_until_{0};
  std::set<const Fault*> begun_;  // those of a step
  std::map<std::pair<std::size_t, std::size_t>, int> cuts_;
};

}  // namespace

Verdict fly_world(const Plan& plan, const std::vector<FlownScenario>& scenarios,
                  const std::filesystem::path& folder, bool keeps_trace) {
  if (plan.has_files) std::filesystem::create_directories(folder);
  const Verdict verdict = World(plan, scenarios, folder, keeps_trace).fly();
  if (plan.has_files) std::filesystem::remove_all(folder);
  return verdict;
}

}  // namespace sls::worlds
