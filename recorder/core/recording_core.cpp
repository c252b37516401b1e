#include "recorder/core/recording_core.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "common/bus/names.hpp"

namespace sls::record {

RecordingCore::RecordingCore(const Parameters& parameters, std::uint64_t first_step, double flush_s,
                             sync::Time now, RecordingOutputs& outputs)
    : run_id_(parameters.run_id()),
      flush_time_(sync::to_duration(flush_s)),
      outputs_(outputs),
      stream_(
          parameters, first_step, [this](const StepRows& rows) { write(rows); },
          [this](std::uint32_t id, std::uint64_t from, std::uint64_t to) {
            note_missing_steps(id, from, to);
          }),
      time_(now),
      flushed_(now) {}

// --- samples in ----------------------------------------------------------------------------------

void RecordingCore::on_earlier_step(const StepRows& rows) {
  std::uint64_t& next = earlier_[rows.vehicle_id];
  if (rows.step > next) note_missing_steps(rows.vehicle_id, next, rows.step - 1);
  account(rows);
  next = rows.step + 1;
}

void RecordingCore::on_earlier_end() {
  for (const auto& [id, step] : stream_.next_steps())
    if (earlier_[id] < step) note_missing_steps(id, earlier_[id], step - 1);
}

void RecordingCore::on_step(const model::StepRecord& record) {
  if (phase_ != Phase::kEnded) stream_.add(record);
}

void RecordingCore::on_batch(const RecordBatch& batch, sync::Time now) {
  if (phase_ == Phase::kEnded || batch.run_id() != run_id_) return;
  time_ = now;
  stream_.add(batch, now);
  note_whole();
}

void RecordingCore::on_status(const SimStatus& status) {
  if (phase_ == Phase::kEnded || status.run_id() != run_id_) return;
  // A server that is discovered again sends its history again.
  if (last_status_ && status.sample_index() <= last_status_->sample_index()) return;
  last_status_ = status;
  // The server's history begins before this segment.
  const bool is_repeated = status.sample_index() < next_status_;
  note_status(status.sample_index());
  outputs_.add(status, is_repeated);
  note_whole();
}

void RecordingCore::on_library(const std::string& controller, const std::string& sha256) {
  constexpr std::size_t kMaxNoted = 256;  // limits the memory for announcements
  if (phase_ != Phase::kEnded && claims_.libraries.size() < kMaxNoted)
    claims_.libraries.try_emplace(controller, sha256);
}

void RecordingCore::on_time(sync::Time now) {
  if (phase_ == Phase::kEnded) return;
  time_ = now;
  stream_.on_time(now);
  if (const auto batch = stream_.take_report(now)) outputs_.log({true, "waiting for: " + *batch});
  note_whole();
  if (now >= flushed_ + flush_time_) flush();
}

void RecordingCore::note_whole() {
  if (has_run_ended() && stream_.has_ended()) phase_ = Phase::kWhole;
}

// --- rows out ------------------------------------------------------------------------------------

void RecordingCore::write(const StepRows& rows) {
  const bool is_full = outputs_.add(rows);
  if (rows.is_unanswered()) ++claims_.unanswered_steps;
  account(rows);
  if (is_full) flush();
}

void RecordingCore::flush() {
  // The manifest comes first: a recorder can be killed at any moment, and rows alone do not give
  // the stage starts.
  if (outputs_.has_new_stage()) outputs_.write_manifest(make_claims());
  outputs_.flush();
  flushed_ = time_;
}

void RecordingCore::account(const StepRows& rows) {
  const std::uint32_t id = rows.vehicle_id;
  // Only the last step of a failed run may be without an answer. A later step shows that this one
  // was not the last.
  if (!bare_steps_.empty())
    if (const auto bare = bare_steps_.extract(id))
      note_missing_answers(id, bare.mapped(), bare.mapped());
  if (!rows.has_state) gaps_.add(id, StateRow::kTopic, rows.step, rows.step);
  if (!rows.has_command && !rows.has_reference)
    bare_steps_[id] = rows.step;
  else if (!rows.has_command)
    gaps_.add(id, CommandRow::kTopic, rows.step, rows.step);
  else if (!rows.has_reference && !rows.is_unanswered())
    gaps_.add(id, ReferenceRow::kTopic, rows.step, rows.step);
}

void RecordingCore::note_missing_steps(std::uint32_t vehicle_id, std::uint64_t from,
                                       std::uint64_t to) {
  gaps_.add(vehicle_id, StateRow::kTopic, from, to);
  note_missing_answers(vehicle_id, from, to);
}

void RecordingCore::note_missing_answers(std::uint32_t vehicle_id, std::uint64_t from,
                                         std::uint64_t to) {
  gaps_.add(vehicle_id, CommandRow::kTopic, from, to);
  gaps_.add(vehicle_id, ReferenceRow::kTopic, from, to);
}

/// Notes the missing steps after the last row of a run that has ended.
void RecordingCore::note_missing_end() {
  if (!has_run_ended()) return;
  // The last step of a failed run may be missing, because it is not always published.
  const std::uint64_t end = last_status_->step() + (is_finished() ? 1 : 0);
  for (const auto& [id, next] : stream_.next_steps())
    if (next < end) note_missing_steps(id, next, end - 1);
  if (!is_finished()) return;
  for (const auto& [id, step] : bare_steps_) note_missing_answers(id, step, step);
}

/// Notes missing status samples: the server keeps only the last ones for late readers.
void RecordingCore::note_status(std::uint64_t sample_index) {
  if (sample_index > next_status_)
    gaps_.add(stream_.next_steps().begin()->first, StatusRow::kTopic, next_status_,
              sample_index - 1);
  next_status_ = std::max(next_status_, sample_index + 1);
}

// --- the end -------------------------------------------------------------------------------------

Claims RecordingCore::on_end(const Interruption& interruption, std::uint64_t refused_samples) {
  if (phase_ == Phase::kEnded) return make_claims();  // the first end is the end
  if (phase_ != Phase::kWhole) interruption_ = interruption.reason;
  phase_ = Phase::kEnded;
  claims_.refused_samples = refused_samples;
  stream_.give_up();
  note_missing_end();
  if (is_finished() && gaps_.missing().empty())  // no step is missing, so late answers are
    for (const MissingSteps& batches : stream_.missing_batches().listed)
      gaps_.add(batches.vehicle_id, kBatchTopic, batches.from, batches.to);
  if (!interruption_.empty()) outputs_.add_event("recorder: " + interruption_);
  const MissingSamples& missing = gaps_.missing();
  if (!missing.empty()) outputs_.add_event("recorder: " + describe(missing));

  Claims claims = make_claims();
  claims.complete = is_finished() && missing.empty() && refused_samples == 0;
  claims.outcome = has_run_ended()         ? bus::to_string(last_status_->phase())
                   : interruption_.empty() ? "lost"
                                           : interruption.outcome;
  claims.reason =
      interruption_.empty() && last_status_ ? last_status_->reason().to_string() : interruption_;
  return claims;
}

Claims RecordingCore::make_claims() const {
  Claims claims = claims_;
  claims.outcome = "recording";
  claims.reason = "not finished: the recorder is running, or was killed";
  if (last_status_) claims.timing = last_status_->timing().to_string();
  claims.last_step =
      has_run_ended() ? last_status_->step()
                      : static_cast<std::uint64_t>(std::max<std::int64_t>(last_complete_step(), 0));
  claims.missing = gaps_.missing();
  claims.dropped = stream_.dropped();
  return claims;
}

std::string RecordingCore::describe_gaps() const {
  std::string text;
  const auto append = [&](const std::string& gap) { text += (text.empty() ? "" : "; ") + gap; };
  if (!interruption_.empty()) append(interruption_);
  if (has_run_ended() && !is_finished()) {
    // The server has printed the reason, and the manifest has it unless it names the interruption.
    std::string reason = last_status_->reason().c_str();
    if (!reason.empty()) reason = ": " + (interruption_.empty() ? "see manifest.json" : reason);
    append(fmt::format("run {}{}", bus::to_string(last_status_->phase()), reason));
  }
  if (!gaps_.missing().empty()) append(describe(gaps_.missing()));
  if (claims_.refused_samples > 0)
    append(fmt::format("{} samples lost because the queue was full", claims_.refused_samples));
  if (text.empty()) return "the run has not ended";
  return text;
}

}  // namespace sls::record
