#include "sim_server/core/report/timing_record.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace sls::sim {

void TimingRecord::add(model::AnswerKind kind, std::uint64_t age) {
  ++periods_;
  if (kind == model::AnswerKind::kHeld) {
    ++held_;
    worst_age_ = std::max(worst_age_, age);
  }
  if (kind == model::AnswerKind::kFailSafe) ++fail_safe_;
}

void TimingRecord::add_delay(double delay_s) { worst_delay_s_ = std::max(worst_delay_s_, delay_s); }

void TimingRecord::add_slip(double lost_s) {
  ++slips_;
  lost_s_ += lost_s;
}

std::string TimingRecord::label() const {
  const std::string defects = describe_defects();
  if (sync_.mode == config::SyncMode::kLockstep)
    return defects.empty() ? "exact" : "degraded: " + defects;
  const double age_ms = static_cast<double>(worst_age_) * sync_.period_ns * 1e-6;
  return fmt::format(
      "{}real-time, {} of {} late, worst age {:.4g} ms, states at most {:.1f} ms late{}",
      defects.empty() ? "" : "degraded: ", held_ + fail_safe_, periods_, age_ms,
      worst_delay_s_ * 1e3, defects.empty() ? "" : ", " + defects);
}

std::string TimingRecord::describe_defects() const {
  std::string text;
  const auto append = [&](const std::string& item) { text += (text.empty() ? "" : ", ") + item; };
  if (held_ > 0 && sync_.mode == config::SyncMode::kLockstep)
    append(fmt::format("{} steps held", held_));
  if (fail_safe_ > 0) append(fmt::format("{} fail-safe", fail_safe_));
  if (slips_ > 0) append(fmt::format("{:.3g} s lost in {} slips", lost_s_, slips_));
  if (overflow_ > 0) append(fmt::format("{} samples unpublished", overflow_));
  return text;
}

void TimingRecord::fill(SyncCounters& counters) const {
  counters.held(held_);
  counters.fail_safe(fail_safe_);
  counters.late(sync_.mode == config::SyncMode::kRealtime ? held_ + fail_safe_ : 0);
  counters.slipped(slips_);
  counters.overflow(overflow_);
}

}  // namespace sls::sim
