#include "recorder/core/stream.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "common/bus/convert.hpp"
#include "common/sync/invariant.hpp"
#include "common/sync/servers.hpp"

namespace sls::record {
namespace {

/// A missing batch is lost when more than this many later ones wait, or after this time.
constexpr std::size_t kMaxWaiting = 64;
constexpr double kMaxStuckTime = 10;  // s

/// A late answer comes at most this many steps later (idl/sls.idl).
constexpr std::uint64_t kMaxLateness = 64;

/// Limit of steps that wait for late answers; 256 vehicles need fewer. It limits the memory for
/// steps out of order.
constexpr std::size_t kMaxPending = 32768;

}  // namespace

Stream::Stream(const Parameters& parameters, std::uint64_t first_step, Sink sink, GapSink gap_sink)
    : format_(make_row_format(parameters)),
      max_step_(static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max() /
                                           std::max<std::int64_t>(parameters.period_ns(), 1))),
      sink_(std::move(sink)),
      gap_sink_(std::move(gap_sink)) {
  for (const std::uint32_t id : sync::list_vehicle_ids(parameters)) next_steps_[id] = first_step;
}

// --- batches -------------------------------------------------------------------------------------

void Stream::add(const RecordBatch& batch, sync::Time now) {
  is_quiet_ = false;
  if (!next_batch_) next_batch_ = batch.batch_index();
  if (batch.batch_index() == *next_batch_ && !has_ended_) {
    handle(batch);
    handle_waiting_batches();
  } else if (has_ended_ || batch.batch_index() < *next_batch_ ||
             !waiting_.emplace(batch.batch_index(), batch).second) {
    dropped_.repeated += batch.entries().size();
  }
  if (waiting_.size() > kMaxWaiting) skip_missing_batches();
  if (!stuck_) begin_to_wait(now);
}

void Stream::begin_to_wait(sync::Time now) {
  if (waiting_.empty()) return;
  stuck_.emplace(now, kMaxStuckTime);
  is_quiet_ = true;
}

void Stream::handle_waiting_batches() {
  while (!waiting_.empty() && waiting_.begin()->first == *next_batch_) {
    handle(waiting_.begin()->second);
    waiting_.erase(waiting_.begin());
  }
}

void Stream::skip_missing_batches() {
  note_missing_batches(waiting_.begin()->first - 1);
  next_batch_ = waiting_.begin()->first;
  handle_waiting_batches();
}

void Stream::note_missing_batches(std::uint64_t last) {
  missing_batches_.add(next_steps_.begin()->first, kBatchTopic, *next_batch_, last);
}

void Stream::on_time(sync::Time now) {
  if (!stuck_ || !stuck_->is_over(now)) return;
  // If nothing has come meanwhile, the later gaps have waited as long as the first one.
  do skip_missing_batches();
  while (is_quiet_ && !waiting_.empty());
  begin_to_wait(now);
}

std::optional<std::string> Stream::take_report(sync::Time now) {
  if (!stuck_ || !stuck_->is_report_due(now)) return std::nullopt;
  return fmt::format("batch {} of sls/record", *next_batch_);
}

void Stream::give_up() {
  while (!waiting_.empty()) skip_missing_batches();
  if (next_batch_ && !has_ended_) note_missing_batches(*next_batch_);
  has_ended_ = true;
  hand_on_settled_steps();
}

// --- entries -------------------------------------------------------------------------------------

void Stream::add(const model::StepRecord& record) {
  static_cast<model::StepRecord&>(next_) = record;
  handle_next();
}

void Stream::handle(const RecordBatch& batch) {
  for (const RecordEntry& entry : batch.entries()) {
    bus::fill(next_, entry);
    handle_next();
  }
  ++*next_batch_;
  stuck_.reset();
  has_ended_ = has_ended_ || batch.is_last();
  hand_on_settled_steps();
}

void Stream::handle_next() {
  const auto vehicle = next_steps_.find(next_.vehicle_id);
  if (vehicle == next_steps_.end() || next_.step > max_step_ ||
      next_.kind > model::AnswerKind::kLate) {
    ++dropped_.out_of_range;
    return;
  }
  if (next_.kind == model::AnswerKind::kLate) return handle_late(next_);
  std::uint64_t& next_step = vehicle->second;
  if (next_.step < next_step) {
    ++dropped_.repeated;
    return;
  }
  if (next_.step > next_step) gap_sink_(vehicle->first, next_step, next_.step - 1);
  next_step = next_.step + 1;
  newest_step_ = std::max(newest_step_, next_.step);
  fill_columns(next_, format_);
  if (pending_.empty() && !may_be_answered(next_)) return sink_(next_);
  pending_.push_back(next_);
  hand_on_settled_steps();
}

void Stream::handle_late(const model::StepRecord& late) {
  const auto rows = std::find_if(pending_.begin(), pending_.end(), [&](const StepRows& pending) {
    return pending.step == late.step && pending.vehicle_id == late.vehicle_id;
  });
  if (rows == pending_.end() || !may_be_answered(*rows)) {
    ++dropped_.repeated;
    return;
  }
  add_reference(*rows, late, format_);
  hand_on_settled_steps();
}

bool Stream::may_be_answered(const StepRows& rows) const {
  return rows.is_unanswered() && !rows.has_reference && newest_step_ <= rows.step + kMaxLateness &&
         !has_ended_;
}

void Stream::hand_on_settled_steps() {
  while (!pending_.empty() &&
         (!may_be_answered(pending_.front()) || pending_.size() > kMaxPending)) {
    sink_(pending_.front());
    pending_.pop_front();
  }
  sync::keep(pending_.size() <= kMaxPending, "a bounded number of steps waits for late answers");
}

std::int64_t Stream::last_step() const {
  std::uint64_t next = next_steps_.empty() ? 0 : next_steps_.begin()->second;
  for (const auto& [id, step] : next_steps_) next = std::min(next, step);
  return static_cast<std::int64_t>(next) - 1;
}

}  // namespace sls::record
