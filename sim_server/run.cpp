#include "sim_server/run.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <csignal>
#include <thread>

#include "common/app/options.hpp"
#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/bus/convert.hpp"
#include "common/bus/names.hpp"
#include "sim_server/fail_safe.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

constexpr auto kUsualStartTime = 300ms;  // for discovery, after the claim: no news
constexpr auto kRosterTime = 100ms;      // until a silent departure is looked for
constexpr auto kPollTime = 20ms;         // while nothing is in a hurry
constexpr auto kRecorderSilence = 1s;    // of one that should be announcing progress
constexpr auto kReportInterval = 5s;     // of the same silence

}  // namespace

Run::Run(Endpoints& endpoints, const config::Scenario& scenario, std::uint64_t run_id,
         std::uint32_t vehicle_id, bool begins_paused)
    : endpoints_(endpoints),
      scenario_(scenario),
      run_id_(run_id),
      vehicle_id_(vehicle_id),
      gate_(run_id, vehicle_id, scenario.controller.force_limit_n),
      board_(endpoints.status_writer, run_id, vehicle_id, scenario.sync, gate_.counters()),
      control_(run_id, vehicle_id, begins_paused),
      absence_(scenario.sync) {
  endpoints_.commands.take_all();  // of an earlier run
  endpoints_.parameters_writer.write(
      make_parameters_message(run_id, vehicle_id, scenario, app::version()));
  const config::Sync& sync = scenario.sync;
  const std::string mode = sync.mode == config::SyncMode::kLockstep
                               ? "lockstep"
                               : fmt::format("real time × {}", sync.real_time_factor);
  spdlog::info("run {:016x}: {}, vehicle {}, {}, period {} s, step {} s", run_id, scenario.name,
               vehicle_id, mode, sync.period_ns * 1e-9, scenario.plant.step_ns * 1e-9);
}

Run::End Run::execute() {
  if (wait_for_participants() && fly()) {
    finish();
    return End::kFinished;
  }
  if (control_.is_stop_requested()) throw app::RunError(control_.last_event());
  reset();
  return End::kReset;
}

void Run::fail(const std::string& reason) {
  close_requests(reason);
  // Before the claim is settled nobody has joined, and there is nobody to tell.
  if (board_.has_published()) board_.publish(PHASE_FAILED, reason);
}

void Run::finish() {
  close_requests("mission finished");
  board_.publish(PHASE_FINISHED, "mission finished");
  const double wall_s = board_.calc_wall_s();
  const auto step = static_cast<double>(board_.step);
  spdlog::info("finished: {} steps, {} s simulated in {:.2f} s, {:.0f} steps/s, {} resent, {}",
               board_.step, step * scenario_.sync.period_ns * 1e-9, wall_s, step / wall_s,
               gate_.counters().resent(), board_.timing.label());
}

void Run::reset() {
  close_requests(control_.last_event());
  board_.publish(PHASE_RESET, control_.last_event());
}

void Run::close_requests(const std::string& reason) {
  for (const SimControlReply& reply : control_.end(board_.step, reason))
    endpoints_.reply_writer.write(reply);
}

// --- start ---------------------------------------------------------------------------------------

void Run::check_claim() const {
  const int progress = board_.has_published() ? bus::calc_progress(board_.phase()) : 0;
  for (const bus::Run& other : endpoints_.servers.runs()) {
    const int others = bus::calc_progress(other.status);
    if (others < 0 || !bus::serves_vehicle(other.parameters, vehicle_id_)) continue;
    if (others > progress || (others == progress && other.parameters.run_id() < run_id_))
      throw app::RunError(
          fmt::format("vehicle {}: expected no other server on this domain, got one (run {:016x})",
                      vehicle_id_, other.parameters.run_id()));
  }
}

void Run::check_stop() {
  if (app::stop_signal() != 0)
    throw app::RunError(
        fmt::format("interrupted by {}", app::stop_signal() == SIGINT ? "SIGINT" : "SIGTERM"));
}

bool Run::wait_for_participants() {
  const auto& expected = scenario_.sync.wait_for;
  app::Wait wait(expected.timeout_s, kUsualStartTime);
  std::string published;
  board_.publish(PHASE_WAITING, "participants are not ready");
  while (true) {
    attend_now_and_then();
    if (attend_to_operator()) return false;
    refresh_roster();
    const std::string missing = name_missing(roster_, expected, scenario_.sha256);
    if (missing.empty()) return true;
    if (wait.is_over())
      throw app::RunError(fmt::format("not ready within {} s: {}{}", expected.timeout_s, missing,
                                      endpoints_.domain.describe_loneliness()));
    if (wait.is_report_due()) {
      spdlog::info("waiting for: {} ({:.0f} s left){}", missing, wait.seconds_left(),
                   endpoints_.domain.describe_loneliness());
      if (missing != published) board_.publish(PHASE_WAITING, "missing: " + missing);
      published = missing;
    }
    std::this_thread::sleep_for(kPollTime);
  }
}

// --- flight --------------------------------------------------------------------------------------

bool Run::fly() {
  SlungLoadPlant plant(scenario_.vehicle, scenario_.plant);
  FaultLine faults(scenario_, vehicle_id_);
  const auto steps_per_period = scenario_.sync.period_ns / scenario_.plant.step_ns;
  board_.start_clock();
  began_ = Clock::now();
  board_.publish(control_.is_paused() ? PHASE_PAUSED : PHASE_RUNNING, control_.last_event());
  begin();
  Applied applied;
  for (std::uint64_t& step = board_.step;; ++step) {
    if (step > 0)
      if (const auto reply = control_.stepped(step)) endpoints_.reply_writer.write(*reply);
    if (!rest() || !wait_for_recorders(step)) return false;
    state_ = plant.state();
    const auto outcome =
        exchange(make_state_message(run_id_, vehicle_id_, step, scenario_.sync.period_ns,
                                    faults.measure(step, state_), state_, applied));
    if (!outcome) return false;
    if (outcome->is_finished) return true;
    applied = outcome->applied;
    applied.f_Q_W = faults.actuate(step, applied.answer_f_Q_W);
    for (std::int64_t i = 0; i < steps_per_period; ++i) plant.step(applied.f_Q_W);
    attend_now_and_then();
  }
}

bool Run::rest() {
  if (attend_to_operator()) return false;
  if (!control_.holds()) return true;
  const auto began = Clock::now();
  bool is_ended = false;
  while (control_.holds() && !is_ended) {
    attend_now_and_then();
    refresh_roster_if_due();
    is_ended = attend_to_operator();
    if (!is_ended && control_.holds()) endpoints_.requests.wait(Clock::now() + kPollTime);
  }
  const auto rest = Clock::now() - began;
  board_.add_pause(rest);
  rested(rest);
  return !is_ended;
}

bool Run::is_meant_for_another_server(const SimControl& request) const {
  return request.run_id() != run_id_ && endpoints_.servers.is_known(request.run_id());
}

bool Run::attend_to_operator() {
  for (const SimControl& request : endpoints_.requests.take_all()) {
    if (is_meant_for_another_server(request)) continue;
    const std::uint64_t events = control_.events();
    if (const auto reply = control_.request(request, board_.step))
      endpoints_.reply_writer.write(*reply);
    if (control_.events() == events) continue;
    const RunPhase phase = board_.phase() == PHASE_WAITING ? PHASE_WAITING
                           : control_.is_paused()          ? PHASE_PAUSED
                                                           : PHASE_RUNNING;
    spdlog::info("step {}: {}", board_.step, control_.last_event());
    board_.publish(phase, control_.last_event());
  }
  return control_.is_reset_requested() || control_.is_stop_requested();
}

void Run::attend_now_and_then() {
  if (!board_.publish_if_due(control_.is_paused() ? control_.last_event() : "")) return;
  check_stop();
  check_claim();
  report_silent_recorder();
}

void Run::refresh_roster() {
  roster_version_ = endpoints_.participants.version();
  roster_time_ = Clock::now();
  roster_ = {endpoints_.participants.find(ROLE_CONTROLLER, run_id_),
             endpoints_.participants.find(ROLE_RECORDER, run_id_), began_};
  gate_.set_clients(find_ready_clients(roster_, scenario_.sha256));
}

void Run::refresh_roster_if_due() {
  if (endpoints_.participants.version() != roster_version_ ||
      Clock::now() - roster_time_ > kRosterTime)
    refresh_roster();
}

// --- answers -------------------------------------------------------------------------------------

void Run::judge(const ReceivedCommand& received) {
  const Verdict verdict = gate_.offer(received.command, received.sender);
  const char* defect = to_string(verdict);
  if (*defect != '\0')
    spdlog::debug("command for step {} from '{}' rejected: {}", received.command.step(),
                  received.command.client_name().c_str(), defect);
}

Run::Outcome Run::take_accepted_answer() {
  const ControlCommand& answer = *gate_.accepted();
  const std::uint64_t step = answer.step();
  board_.controller_name = answer.client_name().to_string();
  if (const auto& switched = gate_.take_over())
    board_.announce(fmt::format("step {}: controller '{}' takes over from '{}'", step, switched->to,
                                switched->from));
  if (is_absence_announced_)
    board_.announce(fmt::format("step {}: controller '{}' answers again after {:.1f} s", step,
                                board_.controller_name, calc_absence_s()));
  absent_since_.reset();
  absence_wait_.reset();
  absence_action_.reset();
  is_absence_announced_ = false;
  absence_.answered();

  Outcome outcome;
  outcome.is_finished = answer.mission() == MISSION_FINISHED;
  outcome.applied.answer_f_Q_W = bus::to_vector(answer.f_Q_W_n());
  outcome.applied.origin = FORCE_ANSWERED;
  outcome.applied.controller_name = board_.controller_name;
  outcome.applied.memory = answer.controller();
  last_answer_ = outcome.applied;
  last_answer_step_ = step;
  if (!outcome.is_finished) board_.timing.add(FORCE_ANSWERED, 0);
  return outcome;
}

Run::Outcome Run::fly_without_answer(std::uint64_t step, ControllerAbsence::Action action) {
  Outcome outcome;
  outcome.applied = last_answer_;
  if (action == ControllerAbsence::Action::kHold && last_answer_.origin != FORCE_NONE) {
    outcome.applied.origin = FORCE_HELD;
  } else {  // also before the first answer, when there is nothing to hold
    outcome.applied.origin = FORCE_FAIL_SAFE;
    outcome.applied.controller_name = kFailSafeName;
    outcome.applied.answer_f_Q_W =
        calc_fail_safe_force(scenario_.vehicle, state_, scenario_.controller.force_limit_n);
  }
  absence_.flown_without_answer();
  board_.controller_name = outcome.applied.controller_name;
  board_.timing.add(outcome.applied.origin, step - last_answer_step_);
  return outcome;
}

double Run::calc_absence_s() const {
  return absent_since_ ? std::chrono::duration<double>(Clock::now() - *absent_since_).count() : 0.0;
}

std::string Run::name_awaited_controller() const {
  if (const auto awaited = gate_.awaited_client())
    return fmt::format("controller '{}' on {}", awaited->name, find_host(roster_, awaited->peer));
  return last_answer_.controller_name.empty()
             ? std::string("controller (none is ready)")
             : fmt::format("controller '{}' (gone)", last_answer_.controller_name);
}

void Run::attend_to_absence(std::uint64_t step, ControllerAbsence::Action action) {
  using Action = ControllerAbsence::Action;
  if (action == Action::kGiveUp)
    throw app::RunError(fmt::format("step {}: waited {} s for {}", step, absence_.give_up_s(),
                                    name_awaited_controller()));
  if (!absence_wait_)
    absence_wait_.emplace(
        absence_.give_up_s() - calc_absence_s(),
        std::max(Clock::duration(0s), Clock::duration(1s) - (Clock::now() - *absent_since_)));
  const bool is_lockstep = scenario_.sync.mode == config::SyncMode::kLockstep;
  // In real time a few held steps are no news: they are counted.
  const bool is_news = action != absence_action_ &&
                       (action == Action::kFailSafe || (action == Action::kHold && is_lockstep));
  if (is_news) {
    absence_action_ = action;
    is_absence_announced_ = true;
    board_.announce(
        fmt::format("step {}: {} for want of an answer of {}", step,
                    action == Action::kHold ? "holds the last force" : "fail-safe force",
                    name_awaited_controller()));
  }
  if (!absence_wait_->is_report_due()) return;
  is_absence_announced_ = true;
  board_.announce(fmt::format("step {}: waiting for: {} ({:.0f} s left)", step,
                              name_awaited_controller(), absence_wait_->seconds_left()));
}

void Run::report_silent_recorder() {
  if (board_.phase() != PHASE_RUNNING) return;
  const auto now = Clock::now();
  if (recorder_report_time_ && now - *recorder_report_time_ < kReportInterval) return;
  const std::string silent = name_silent_recorder(roster_, board_.step, now - kRecorderSilence);
  if (silent.empty()) return;
  recorder_report_time_ = now;
  board_.announce(fmt::format("step {}: {}", board_.step, silent));
}

}  // namespace sls::sim
