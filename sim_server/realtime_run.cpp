#include "sim_server/realtime_run.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

#include "common/app/run_main.hpp"
#include "common/app/scheduling.hpp"
#include "common/app/wait.hpp"
#include "common/config/numbers.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

/// Capacity of the queue to the writer thread, in samples: a second at 1 kHz and one per step.
constexpr std::size_t kQueuedSteps = 1024;

/// Periods in a row without an answer after which the next client's answer is used.
constexpr int kMissesBeforeTakeOver = 3;

/// A client that sends no answer for this long may have a clock for which LIFESPAN drops them all.
constexpr auto kMeasured = 1s;

/// Only slow answers for so long are the law's, not those of a busy machine.
constexpr int kSlowAnswers = 3;
constexpr auto kSlowTime = 1s;

constexpr auto kProgressInterval = 5s;

/// Longer computing times in answers are not credible.
constexpr std::uint64_t kLongestComputing_ns = 60'000'000'000;

std::chrono::duration<double, std::nano> calc_wall_period(const config::Sync& sync) {
  return std::chrono::duration<double, std::nano>(static_cast<double>(sync.period_ns) /
                                                  sync.real_time_factor);
}

}  // namespace

RealtimeRun::RealtimeRun(Endpoints& endpoints, const Assignment& assignment, WorkerPool& workers,
                         std::uint64_t run_id, bool begins_paused)
    : Run(endpoints, assignment, workers, run_id, begins_paused),
      state_queue_(endpoints.states, kQueuedSteps),
      schedule_(Clock::now(), calc_wall_period(scenario_.sync)) {}

void RealtimeRun::begin() {
  if (!app::put_process_first())
    spdlog::info(
        "real-time priority refused (needs root, CAP_SYS_NICE or RLIMIT_RTPRIO): steps may be "
        "late");
  schedule_ = Schedule(Clock::now(), calc_wall_period(scenario_.sync));
  missed_deadlines_ = endpoints_.command_stream.missed_deadlines();
  next_progress_ = Clock::now() + kProgressInterval;
}

void RealtimeRun::report_progress() {
  if (Clock::now() < next_progress_) return;
  next_progress_ = Clock::now() + kProgressInterval;
  if (::isatty(STDERR_FILENO) != 0)
    spdlog::info(
        "step {}: {:.0f} s of simulated time, {}", board_.step,
        config::to_seconds(static_cast<std::int64_t>(board_.step) * scenario_.sync.period_ns),
        board_.timing.label());
}

void RealtimeRun::note_rest(Clock::duration rest) {
  Run::note_rest(rest);
  schedule_.pause(rest);
  missed_deadlines_ = endpoints_.command_stream.missed_deadlines();  // no command was due
}

bool RealtimeRun::exchange() {
  if (!wait_until_due()) return false;
  report_progress();
  for (const auto& vehicle : vehicles_) vehicle->gate.expect(board_.step);
  publish();
  if (!take_commands(schedule_.close(board_.step, published_))) return false;
  if (is_ending() && !are_all_accepted() && !wait_for_last_answers()) return false;
  count_missed_deadlines();
  board_.timing.set_overflow(state_queue_.lost() + record_.lost());

  for (const auto& vehicle : vehicles_) {
    if (vehicle->gate.accepted()) continue;
    vehicle->note_waiting(published_);
    const bool is_silent = vehicle->gate.count_miss() >= kMissesBeforeTakeOver ||
                           vehicle->calc_absence_s(Clock::now()) >= scenario_.sync.take_over_s;
    if (is_silent) vehicle->gate.pass_over_silent_client();
  }
  take_answers();
  fly_without_answers();
  return true;
}

void RealtimeRun::fly_without_answers() {
  using Action = ControllerAbsence::Action;
  Action most = Action::kWait;
  for (const auto& vehicle : vehicles_) {
    if (vehicle->is_settled()) continue;
    const Action action = vehicle->absence.decide(0.0, vehicle->calc_absence_s(Clock::now()));
    most = std::max(most, action);
    if (action != Action::kGiveUp) vehicle->fly_without_answer(action);
  }
  if (most != Action::kWait) attend_to_absence(most);
}

void RealtimeRun::publish() {
  const auto now = Clock::now();
  if (const auto lost = schedule_.slip(board_.step, now))
    board_.timing.add_slip(std::chrono::duration<double>(*lost).count());
  board_.timing.add_delay(std::chrono::duration<double>(now - schedule_.due(board_.step)).count());
  published_ = now;
  published_stamps_[board_.step % published_stamps_.size()] = std::chrono::system_clock::now();
  publish_states();
}

bool RealtimeRun::wait_until_due() {
  while (Clock::now() + app::kPollTime < schedule_.due(board_.step)) {
    endpoints_.requests.wait(Clock::now() + app::kPollTime);
    do_housekeeping();
    if (!rest() || !wait_for_recorders()) return false;
  }
  std::this_thread::sleep_until(schedule_.due(board_.step));
  return true;
}

bool RealtimeRun::take_commands(Clock::time_point deadline) {
  while (!are_all_accepted() && Clock::now() < deadline) {
    endpoints_.commands.wait(std::min(deadline, Clock::now() + app::kPollTime));
    for (const ReceivedCommands& received : endpoints_.commands.take_all()) {
      judge(received.sample, received.sender, received.arrived < published_);
      note_clock(received);
      note_computing(received);
    }
    check_refusals();
    if (are_all_accepted()) {
      board_.round_trips.add(Clock::now() - published_);
      return true;
    }
    do_housekeeping();
    if (is_roster_due()) refresh_roster();
    if (attend_to_operator()) return false;
  }
  return true;
}

bool RealtimeRun::is_ending() const {
  return std::all_of(vehicles_.begin(), vehicles_.end(), [](const auto& vehicle) {
    const auto& accepted = vehicle->gate.accepted();
    return accepted ? accepted->answer.mission == model::MissionPhase::kFinished
                    : vehicle->has_ended_late();
  });
}

void RealtimeRun::note_late(Vehicle& vehicle, const OfferedAnswer& offered) {
  const auto age = Clock::now() - schedule_.due(offered.step);
  const auto lifespan = endpoints_.command_stream.lifespan();
  if (lifespan && age > *lifespan)
    ++link_.stale();
  else
    vehicle.keep_late_answer(offered);
}

bool RealtimeRun::wait_for_last_answers() {
  constexpr int kAttempts = 20;
  for (int i = 0; i < kAttempts && !are_all_accepted(); ++i) {
    if (!take_commands(Clock::now() + 50ms)) return false;
    if (are_all_accepted()) return true;
    ++link_.resent();
    endpoints_.states.write();
  }
  if (!are_all_accepted())
    throw app::RunError(fmt::format("step {}: the mission was finished, but {} does not answer",
                                    board_.step, name_awaited_controllers()));
  return true;
}

void RealtimeRun::count_missed_deadlines() {
  const std::uint64_t missed = endpoints_.command_stream.missed_deadlines();
  link_.deadline_missed() += missed - missed_deadlines_;
  missed_deadlines_ = missed;
}

void RealtimeRun::note_clock(const ReceivedCommands& received) {
  const Commands& sample = received.sample;
  const auto client = clocks_.find(received.sender);
  const bool is_known =
      sample.step() <= board_.step && board_.step - sample.step() < published_stamps_.size();
  if (client == clocks_.end() || sample.run_id() != run_id_ || !is_known) return;
  ClockOffset::Exchange exchange;
  exchange.published = published_stamps_[sample.step() % published_stamps_.size()];
  exchange.computing = std::chrono::nanoseconds(0);
  for (const ControlCommand& command : sample.vehicles())
    exchange.computing +=
        std::chrono::nanoseconds(std::min(command.compute_time_ns(), kLongestComputing_ns));
  exchange.written = received.written;
  exchange.arrived = std::chrono::system_clock::now() - (Clock::now() - received.arrived);
  client->second.offset.note(exchange);
  client->second.noted = Clock::now();
}

void RealtimeRun::note_computing(const ReceivedCommands& received) {
  if (received.sample.run_id() != run_id_ || clocks_.count(received.sender) == 0) return;
  std::chrono::duration<double> computing(0.0);
  for (const ControlCommand& command : received.sample.vehicles())
    computing +=
        std::chrono::nanoseconds(std::min(command.compute_time_ns(), kLongestComputing_ns));
  const std::chrono::duration<double> period = calc_wall_period(scenario_.sync);
  SlowAnswers& slow = slow_answers_[received.sender];
  if (computing <= period) slow.count = 0;
  if (computing <= period || slow.is_reported) return;
  if (slow.count++ == 0) slow.since = Clock::now();
  slow.is_reported = slow.count >= kSlowAnswers && Clock::now() - slow.since >= kSlowTime;
  if (slow.is_reported)
    board_.announce(fmt::format(
        "step {}: controller '{}' computes an answer for {:.3g} ms, expected less than the "
        "period of {:.3g} ms: its answers come late (a lower --rtf or a longer --period-s gives it "
        "time)",
        board_.step, received.sample.client_name().c_str(), 1e3 * computing.count(),
        1e3 * period.count()));
}

void RealtimeRun::check_clocks() {
  const auto lifespan = endpoints_.command_stream.lifespan();
  if (!lifespan) return;
  std::map<bus::PeerId, ClientClock> present;
  bool is_any_wrong = false;
  for (const auto& client : roster_.controllers) {
    ClientClock& clock = present[client.peer];
    const auto known = clocks_.find(client.peer);
    if (known != clocks_.end()) clock = known->second;
    if (Clock::now() - clock.noted > kMeasured) clock.offset = ClockOffset();
    const auto offset = clock.offset.offset();
    // A clock near the limit must not be reported again and again.
    const auto limit = clock.is_wrong ? *lifespan * 2 / 5 : *lifespan / 2;
    const bool is_wrong = offset ? std::chrono::abs(*offset) > limit : clock.is_wrong;
    if (is_wrong != std::exchange(clock.is_wrong, is_wrong))
      announce_clock(client, *offset, is_wrong);
    is_any_wrong = is_any_wrong || is_wrong || (!offset && client.age > *lifespan);
  }
  clocks_ = std::move(present);
  if (is_any_wrong != std::exchange(is_lifespan_ignored_, is_any_wrong))
    endpoints_.command_stream.ignore_lifespan(is_any_wrong);
}

void RealtimeRun::announce_clock(const sync::Member& client, std::chrono::nanoseconds offset,
                                 bool is_wrong) {
  const double ahead_s = std::chrono::duration<double>(offset).count();
  const std::string clock =
      fmt::format("the clock of controller '{}' on {}", client.announcement.name().c_str(),
                  client.announcement.host().c_str());
  board_.announce(
      is_wrong
          ? fmt::format("{} is {:.2f} s {} ours: synchronise the clocks; until then its commands "
                        "expire by their step, not by LIFESPAN",
                        clock, std::abs(ahead_s), ahead_s < 0 ? "behind" : "ahead of")
          : clock + " agrees with ours again: its commands expire by LIFESPAN again");
}

bool RealtimeRun::wait_for_recorders() {
  if (is_roster_due()) refresh_roster();
  const std::string blocking =
      name_blocking_recorder(roster_, scenario_.sync.wait_for.recorders, board_.step,
                             calc_recorder_window(record_.history_steps()));
  const auto& patience = scenario_.sync.wait.recorder;
  if (blocking.empty()) {
    recorder_wait_.reset();
    return true;
  }
  // In real time a flight does not wait for recorders; only the policy `stop` ends it.
  if (!recorder_wait_) recorder_wait_.emplace(patience.deadline_s);
  if (patience.policy == config::RecorderPolicy::kStop && recorder_wait_->is_over())
    throw app::RunError(
        fmt::format("step {}: waited {} s for {}", board_.step, patience.deadline_s, blocking));
  if (recorder_wait_->is_report_due())
    board_.announce(fmt::format("step {}: continues without: {}", board_.step, blocking));
  return true;
}

}  // namespace sls::sim
