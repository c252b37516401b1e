#include "worlds/status_check.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "common/sync/servers.hpp"
#include "worlds/flight_watch.hpp"
#include "worlds/program.hpp"

namespace sls::worlds {
namespace {

constexpr Instant kLongestInterval = std::chrono::milliseconds(500) + FlightWatch::kSlack;

}  // namespace

void StatusCheck::on_recorded(const std::vector<model::StepRecord>& records) {
  before_ = counts_;
  for (const model::StepRecord& record : records) {
    flown_ += record.step > 0;  // the step before it
    answered_ +=
        record.kind != model::AnswerKind::kNone && record.kind != model::AnswerKind::kRefused;
    counts_.fail_safe += record.kind == model::AnswerKind::kFailSafe;
    if (record.kind == model::AnswerKind::kHeld) {
      ++counts_.held;
      counts_.worst_age = std::max(counts_.worst_age, record.step - record.answered_step);
    }
    if (record.kind != model::AnswerKind::kAccepted) continue;
    ++accepted_;
    const auto [flyer, is_first] = flyers_.try_emplace(record.vehicle_id, record.client_name);
    changes_ += !is_first && flyer->second != record.client_name;
    flyer->second = record.client_name;
  }
}

void StatusCheck::on_status(const SimStatus& status) {
  const Instant now = server_.awake();
  is_disturbed_ = is_disturbed_ || server_.is_slow();
  was_disturbed_ = was_disturbed_ || is_disturbed_;
  if (last_) {
    if (!is_disturbed_ && now - last_time_ > kLongestInterval)
      find_(fmt::format("status: sample {} comes {:.3f} s after the one before",
                        status.sample_index(), sync::to_seconds(now - last_time_)));
    if (status.sample_index() != last_->sample_index() + 1)
      find_(fmt::format("status: sample {} comes after {}", status.sample_index(),
                        last_->sample_index()));
    if (status.step() < last_->step())
      find_(fmt::format("status: step {} comes after {}", status.step(), last_->step()));
  }
  if (status.step() > step_ + 1)  // it may be about to be published
    find_(fmt::format("status: step {} is far, the last published was {}", status.step(), step_));
  if (status.round_trip_p50_ns() > status.round_trip_p99_ns())
    find_("status: the median of the round trips is above their 99th percentile");
  is_over_ = sync::calc_progress(status.phase()) < 0;
  const SyncCounters& said = status.counters();
  check_counter("resent", said.resent(), resent_, resent_);
  const bool is_finished = status.phase() == RunPhase::PHASE_FINISHED;
  const Counts& least = is_finished ? counts_ : before_;
  check_counter("held", said.held(), least.held, counts_.held);
  check_counter("fail_safe", said.fail_safe(), least.fail_safe, counts_.fail_safe);
  // Whom the first flyer took over from has flown no step, and the open step is not recorded.
  check_counter("take_overs", said.take_overs(), changes_, changes_ + 2 * vehicles_);
  const std::string timing = status.timing().to_string();
  // The last step of a flight that is not finished may count, or not.
  const auto holds = [&](const Counts& counts, std::uint64_t steps) {
    return timing.find(describe_timing(counts, steps)) != std::string::npos;
  };
  const bool is_right =
      holds(counts_, flown_) || holds(least, flown_) || (!is_finished && holds(counts_, answered_));
  if (is_over_ && flown_ > 0 && !is_right)
    find_(fmt::format("timing-label: expected '{}', got '{}'", describe_timing(counts_, flown_),
                      timing));
  const bool has_round_trips = status.round_trip_p50_ns() > 0;
  const bool was_answered = !was_disturbed_ && flown_ > 0 && counts_.held + counts_.fail_safe == 0;
  const bool lacks_them = was_answered && !has_round_trips;
  if (is_over_ && (lacks_them || (has_round_trips && accepted_ == 0)))
    find_("status: round trips are said without answers, or not said with them");
  last_ = status;
  last_time_ = now;
  is_disturbed_ = server_.is_slow();
}

/// The last status says what happened; those before, which may be queued for a moment, not more.
void StatusCheck::check_counter(const char* name, std::uint64_t said, std::uint64_t happened,
                                std::uint64_t most) {
  if (said > most || (is_over_ && said < happened))
    find_(fmt::format("status: {} is {}, but {} happened", name, said, happened));
}

/// What the label must hold.
std::string StatusCheck::describe_timing(const Counts& counts, std::uint64_t steps) const {
  const auto& [held, fail_safe, worst_age] = counts;
  if (sync_.mode == config::SyncMode::kRealtime)
    return fmt::format("real-time, {} of {} late, worst age {:.4g} ms, ", held + fail_safe, steps,
                       static_cast<double>(worst_age * sync_.period_ns) * 1e-6);
  if (held + fail_safe == 0) return "exact";
  std::string text = "degraded: ";
  if (held > 0) text += fmt::format("{} steps held", held);
  if (fail_safe > 0) text += fmt::format("{}{} fail-safe", held > 0 ? ", " : "", fail_safe);
  return text;
}

}  // namespace sls::worlds
