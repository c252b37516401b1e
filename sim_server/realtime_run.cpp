#include "sim_server/realtime_run.hpp"

#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "common/app/run_main.hpp"
#include "common/bus/convert.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

/// States between loop and writing thread: a second at 1 kHz.
constexpr std::size_t kQueueSize = 1024;

/// Periods in a row that a client may let go by before another one's answer is taken.
constexpr int kMissesBeforeTakeOver = 3;

std::chrono::duration<double, std::nano> calc_wall_period(const config::Sync& sync) {
  return std::chrono::duration<double, std::nano>(static_cast<double>(sync.period_ns) /
                                                  sync.real_time_factor);
}

}  // namespace

RealtimeRun::RealtimeRun(Endpoints& endpoints, const config::Scenario& scenario,
                         std::uint64_t run_id, std::uint32_t vehicle_id, bool begins_paused)
    : Run(endpoints, scenario, run_id, vehicle_id, begins_paused),
      state_queue_(endpoints.state_writer, kQueueSize),
      schedule_(Clock::now(), calc_wall_period(scenario.sync)) {}

void RealtimeRun::begin() {
  schedule_ = Schedule(Clock::now(), calc_wall_period(scenario_.sync));
  missed_deadlines_ = endpoints_.command_reader.missed_deadlines();
}

void RealtimeRun::rested(Clock::duration rest) {
  schedule_.pause(rest);
  missed_deadlines_ = endpoints_.command_reader.missed_deadlines();  // nobody was asked
}

std::optional<Run::Outcome> RealtimeRun::exchange(const VehicleState& state) {
  const std::uint64_t step = state.step();
  gate_.expect(step);
  publish(state);
  take_commands(schedule_.close(step, published_));
  if (is_ending_ && !gate_.accepted()) wait_for_last_answer(state);
  count_missed_deadlines();
  board_.timing.set_overflow(state_queue_.lost());

  if (!gate_.accepted()) {
    note_waiting(published_);
    const bool is_silent = gate_.count_miss() >= kMissesBeforeTakeOver ||
                           calc_absence_s() >= scenario_.sync.take_over_s;
    if (is_silent) gate_.pass_over_silent_client();
  }
  if (gate_.accepted()) return take_accepted_answer();
  const auto action = absence_.decide(0.0, calc_absence_s());
  attend_to_absence(step, action);
  return fly_without_answer(step, action);
}

void RealtimeRun::publish(const VehicleState& state) {
  const auto now = Clock::now();
  if (const auto lost = schedule_.slip(state.step(), now))
    board_.timing.add_slip(std::chrono::duration<double>(*lost).count());
  board_.timing.add_delay(std::chrono::duration<double>(now - schedule_.due(state.step())).count());
  published_ = now;
  state_queue_.write(state);
}

void RealtimeRun::take_commands(Clock::time_point deadline) {
  while (Clock::now() < deadline) {
    const auto received = endpoints_.commands.take(deadline);
    if (!received) return;
    const bool was_accepted = gate_.accepted().has_value();
    const Verdict verdict = gate_.offer(received->command, received->sender);
    if (verdict == Verdict::kLate) take_late(received->command);
    if (const auto refusal = gate_.refusal()) throw app::RunError(*refusal);
    if (was_accepted || !gate_.accepted()) continue;
    board_.round_trips.add(Clock::now() - published_);
    if (gate_.accepted()->mission() == MISSION_FINISHED) return;
  }
}

void RealtimeRun::take_late(const ControlCommand& command) {
  const auto age = Clock::now() - schedule_.due(command.step());
  const auto lifespan = endpoints_.command_reader.lifespan();
  if (lifespan && age > *lifespan) {
    ++gate_.counters().stale();
    return;
  }
  if (command.mission() == MISSION_FINISHED) {
    is_ending_ = true;
    return;
  }
  if (last_answer_.origin != FORCE_NONE && command.step() <= last_answer_step_) return;
  last_answer_.answer_f_Q_W = bus::to_vector(command.f_Q_W_n());
  last_answer_.origin = FORCE_ANSWERED;
  last_answer_.controller_name = command.client_name().to_string();
  last_answer_.memory = command.controller();
  last_answer_step_ = command.step();
}

void RealtimeRun::wait_for_last_answer(const VehicleState& state) {
  constexpr int kAttempts = 20;
  for (int i = 0; i < kAttempts && !gate_.accepted(); ++i) {
    take_commands(Clock::now() + 50ms);
    if (gate_.accepted()) return;
    ++gate_.counters().resent();
    state_queue_.write(state);
  }
  if (!gate_.accepted())
    throw app::RunError(fmt::format("step {}: the mission was finished, but {} does not answer",
                                    state.step(), name_awaited_controller()));
}

void RealtimeRun::count_missed_deadlines() {
  const std::uint64_t missed = endpoints_.command_reader.missed_deadlines();
  gate_.counters().deadline_missed() += missed - missed_deadlines_;
  missed_deadlines_ = missed;
}

void RealtimeRun::check_clocks() {
  const auto lifespan = endpoints_.command_reader.lifespan();
  if (!lifespan || is_lifespan_ignored_) return;
  for (const auto& client : roster_.controllers) {
    if (std::chrono::abs(client.age) <= *lifespan / 2) continue;
    is_lifespan_ignored_ = true;
    endpoints_.command_reader.ignore_lifespan();
    const double behind_s = std::chrono::duration<double>(client.age).count();
    board_.announce(fmt::format(
        "the clock of controller '{}' on {} is {:.1f} s {} ours: its commands do not expire by it "
        "(LIFESPAN), only by their step; synchronise the clocks",
        client.announcement.name().c_str(), client.announcement.host().c_str(), std::abs(behind_s),
        behind_s > 0 ? "behind" : "ahead of"));
    return;
  }
}

bool RealtimeRun::wait_for_recorders(std::uint64_t step) {
  refresh_roster_if_due();
  check_clocks();
  const std::string blocking =
      name_blocking_recorder(roster_, scenario_.sync.wait_for.recorders, step);
  const auto& patience = scenario_.sync.wait.recorder;
  if (blocking.empty()) {
    recorder_wait_.reset();
    return true;
  }
  // The flight does not wait; `stop` still ends it.
  if (!recorder_wait_) recorder_wait_.emplace(patience.deadline_s);
  if (patience.policy == config::RecorderPolicy::kStop && recorder_wait_->is_over())
    throw app::RunError(
        fmt::format("step {}: waited {} s for {}", step, patience.deadline_s, blocking));
  if (recorder_wait_->is_report_due())
    board_.announce(fmt::format("step {}: flies on without: {}", step, blocking));
  return true;
}

}  // namespace sls::sim
