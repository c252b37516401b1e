#include "sim_server/lockstep_run.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/bus/spinning.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

std::chrono::steady_clock::duration to_duration(double seconds) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(seconds));
}

}  // namespace

LockstepRun::~LockstepRun() {
  bus::stop_spinning();
  endpoints_.command_stream.set_handler(nullptr);
}

void LockstepRun::begin() {
  bus::start_spinning();
  main_lock_.lock();
  endpoints_.command_stream.set_handler([this](const Commands& sample, const bus::PeerId& sender) {
    return receive(sample, sender);
  });
}

// --- on the main thread --------------------------------------------------------------------------

bool LockstepRun::exchange() {
  publish();
  while (true) {
    if (error_) std::rethrow_exception(error_);
    for (const ReceivedCommands& received : endpoints_.commands.take_all())
      judge(received.sample, received.sender);
    check_refusals();
    if (are_all_accepted()) {
      take_answered_step();
      return true;
    }
    const auto now = Clock::now();
    if (now >= wake_at_.load()) {
      if (!attend_to_silence(now)) return false;
      if (is_settled()) return true;
      if (are_all_accepted()) continue;
    }
    main_lock_.unlock();
    // Each step that the middleware's thread takes meanwhile moves `wake_at_`: wait for its last
    // value.
    while (!endpoints_.commands.wait(wake_at_) && Clock::now() < wake_at_.load()) {
    }
    main_lock_.lock();
  }
}

void LockstepRun::publish() {
  for (const auto& vehicle : vehicles_) vehicle->gate.expect(board_.step);
  sent_ = last_sent_ = looked_ = Clock::now();
  publish_states();
  resend_at_ = sent_ + timer_.timeout();
  // While steps are flown without answers, each waits one period for its answer.
  const auto period = to_duration(static_cast<double>(scenario_.sync.period_ns) * 1e-9 /
                                  scenario_.sync.real_time_factor);
  wake_at_ = is_anybody_absent() ? std::min(resend_at_, sent_ + period) : resend_at_;
  is_late_ = false;
}

void LockstepRun::take_answered_step() {
  const auto answered = Clock::now();
  timer_.answered(answered - sent_, answered - last_sent_);
  board_.round_trips.add(answered - sent_);
  take_answers();
}

bool LockstepRun::is_settled() const {
  return std::all_of(vehicles_.begin(), vehicles_.end(),
                     [](const auto& vehicle) { return vehicle->is_settled(); });
}

bool LockstepRun::attend_to_silence(Clock::time_point now) {
  if (!is_late_) take_over_at_ = sent_ + to_duration(scenario_.sync.take_over_s);
  is_late_ = true;
  for (const auto& vehicle : vehicles_)
    if (!vehicle->gate.accepted()) vehicle->note_waiting(sent_);
  if (control_.holds()) note_rest(now - looked_);  // a pause does not count as absence
  looked_ = now;
  if (now >= resend_at_) resend(now);
  do_housekeeping();
  if (attend_to_operator()) return false;
  refresh_roster();
  take_over_if_silent(now);
  if (!are_all_accepted()) fly_without_answers(now);
  const auto next_look = now + 1ms;
  wake_at_ =
      std::min(resend_at_, is_anybody_absent() ? next_look : std::max(take_over_at_, next_look));
  return true;
}

void LockstepRun::resend(Clock::time_point now) {
  last_sent_ = now;
  endpoints_.states.write_where(
      [this](std::size_t i) { return !vehicles_[i]->gate.accepted().has_value(); });
  ++link_.resent();
  timer_.resent();
  resend_at_ = last_sent_ + timer_.timeout();
}

/// Settles the step unless, by the policy, a vehicle without an answer still waits for it.
void LockstepRun::fly_without_answers(Clock::time_point now) {
  using Action = ControllerAbsence::Action;
  const double step_wait_s = std::chrono::duration<double>(now - sent_).count();
  std::vector<std::pair<Vehicle*, Action>> actions;
  for (const auto& vehicle : vehicles_)
    if (!vehicle->gate.accepted())
      actions.emplace_back(vehicle.get(),
                           vehicle->absence.decide(step_wait_s, vehicle->calc_absence_s(now)));
  const auto [least, most] =
      std::minmax_element(actions.begin(), actions.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; });
  const bool waits = least->second == Action::kWait && most->second != Action::kGiveUp;
  attend_to_absence(waits ? Action::kWait : most->second);
  if (waits) return;
  for (const auto& [vehicle, action] : actions) vehicle->fly_without_answer(action);
  take_answers();
}

void LockstepRun::take_over_if_silent(Clock::time_point now) {
  if (now < take_over_at_) return;
  bool is_anybody_passed_over = false;
  for (const auto& vehicle : vehicles_)
    is_anybody_passed_over = vehicle->gate.pass_over_silent_client() || is_anybody_passed_over;
  if (is_anybody_passed_over) take_over_at_ = now + to_duration(scenario_.sync.take_over_s);
}

// --- on the middleware's thread ------------------------------------------------------------------

bool LockstepRun::receive(const Commands& sample, const bus::PeerId& sender) {
  const std::unique_lock lock(step_mutex_, std::try_to_lock);
  if (!lock || error_ || !is_plain_step()) return false;
  try {
    judge(sample, sender);
    if (!are_all_accepted()) {
      const bool is_refused =
          std::any_of(vehicles_.begin(), vehicles_.end(),
                      [](const auto& vehicle) { return vehicle->gate.refusal().has_value(); });
      if (is_refused) endpoints_.commands.interrupt();
      return true;
    }
    const bool is_news = std::any_of(vehicles_.begin(), vehicles_.end(), [](const auto& vehicle) {
      return vehicle->gate.take_over() ||
             vehicle->gate.accepted()->answer.mission == model::MissionPhase::kFinished;
    });
    if (is_news) {
      endpoints_.commands.interrupt();
      return true;
    }
    take_answered_step();
    advance();
    publish();
  } catch (...) {  // must not reach the middleware
    error_ = std::current_exception();
    endpoints_.commands.interrupt();
  }
  return true;
}

/// True if the server needs only the answers to go from the step in work to the next one.
bool LockstepRun::is_plain_step() const {
  return !is_late_ && !is_anybody_absent() && !control_.is_paused() &&
         endpoints_.requests.is_empty() && !is_roster_due() && !board_.is_due() &&
         board_.step + 1 < recorder_limit_ && !record_.is_full() && !is_look_due() &&
         app::stop_signal() == 0;
}

// --- recorders -----------------------------------------------------------------------------------

std::string LockstepRun::name_blocking() const {
  return name_blocking_recorder(roster_, scenario_.sync.wait_for.recorders, board_.step,
                                calc_recorder_window(record_.history_steps()));
}

void LockstepRun::roster_changed() {
  recorder_limit_ = calc_recorder_limit(roster_, scenario_.sync.wait_for.recorders,
                                        calc_recorder_window(record_.history_steps()));
}

std::string LockstepRun::name_full_queue() const {
  return record_.is_full() ? std::string("recorder: the queue of sls/record is full")
                           : std::string();
}

bool LockstepRun::wait_for_recorders() {
  if (is_roster_due()) refresh_roster();
  return wait_while(&LockstepRun::name_full_queue, is_queue_given_up_) &&
         wait_while(&LockstepRun::name_blocking, are_recorders_given_up_);
}

bool LockstepRun::wait_while(std::string (LockstepRun::*name_cause)() const, bool& is_given_up) {
  using config::RecorderPolicy;
  const auto& patience = scenario_.sync.wait.recorder;
  const std::uint64_t step = board_.step;
  std::string cause = (this->*name_cause)();
  if (cause.empty() && is_given_up) {
    is_given_up = false;
    board_.announce(fmt::format("step {}: the recorders are back", step));
  }
  if (is_given_up) return true;
  std::optional<app::Wait> wait;
  std::uint64_t written = record_.written();
  bool is_reported = false;
  for (; !cause.empty(); cause = (this->*name_cause)()) {
    do_housekeeping();
    if (attend_to_operator()) return false;
    if (!wait) wait.emplace(patience.deadline_s);
    // While the queue gets shorter, only the network is slow.
    if (std::exchange(written, record_.written()) != written) wait->renew();
    if (wait->is_over()) {
      const std::string waited =
          fmt::format("step {}: waited {} s for {}", step, patience.deadline_s, cause);
      if (patience.policy != RecorderPolicy::kGoOn) throw app::RunError(waited);
      board_.announce(waited + ": continues without it");
      is_given_up = true;
      return true;
    }
    if (wait->is_report_due()) {
      is_reported = true;
      board_.announce(fmt::format("step {}: waiting for: {} ({:.0f} s left)", step, cause,
                                  wait->seconds_left()));
    }
    std::this_thread::sleep_for(1ms);
    refresh_roster();
  }
  if (is_reported) board_.announce(fmt::format("step {}: the recorders are back", step));
  return true;
}

}  // namespace sls::sim
