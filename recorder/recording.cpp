#include "recorder/recording.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <sstream>
#include <system_error>

#include "common/bus/names.hpp"
#include "common/sync/servers.hpp"

namespace sls::record {
namespace {

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream << text;
  stream.close();
  if (!stream)
    throw std::system_error(errno, std::generic_category(), file.string() + ": cannot write");
}

Segment make_only_segment(const std::filesystem::path& folder) {
  Segment segment;
  segment.folder = folder;
  return segment;
}

/// All segments are of one run, so they have the same scenario.
config::Scenario parse_scenario(const Segment& segment, const Parameters& parameters) {
  if (segment.earlier &&
      segment.earlier->manifest().scenario_sha256 != parameters.scenario_sha256().to_string())
    throw config::ConfigError(fmt::format(
        "{}: expected scenario {} of the earlier segments, got {}", segment.folder.string(),
        segment.earlier->manifest().scenario_sha256, parameters.scenario_sha256().c_str()));
  if (parameters.vehicles().empty())
    throw config::ConfigError("sls/parameters: vehicles: expected at least one, got none");
  return config::parse_scenario(parameters.scenario_text().to_string(), "sls/parameters");
}

}  // namespace

Recording::Recording(const std::filesystem::path& folder, const Parameters& parameters)
    : Recording(make_only_segment(folder), parameters) {}

Recording::Recording(const Segment& segment, const Parameters& parameters)
    : segment_(segment),
      parameters_(parameters),
      scenario_(parse_scenario(segment, parameters)),
      sinks_(make_sinks(segment.folder, parameters_, scenario_.record)),
      log_(scenario_, parameters_),
      stream_(
          parameters_, segment.first_step, [this](const StepRows& rows) { write(rows); },
          [this](std::uint32_t id, std::uint64_t from, std::uint64_t to) {
            note_missing_steps(id, from, to);
          }) {
  write_text(segment_.folder / "scenario.yaml", scenario_.text);
  flush();
  read_earlier_segments();
  write_provisional_manifest();
}

void Recording::write_provisional_manifest() {
  Manifest manifest = make_manifest();
  manifest.outcome = "recording";
  manifest.reason = "not finished: the recorder is running, or was killed";
  write_manifest(segment_.folder, manifest);
  stage_starts_ = manifest.stage_starts;
}

/// Reads the earlier segments, because certificate, log and gaps cover the whole flight.
void Recording::read_earlier_segments() {
  if (!segment_.earlier) return;
  log_.set_stage_starts(segment_.earlier->manifest().stage_starts);
  std::map<std::uint32_t, std::uint64_t> next_steps;
  StepReader reader(*segment_.earlier, segment_.first_step);
  while (const auto rows = reader.next()) {
    std::uint64_t& next = next_steps[rows->vehicle_id];
    if (rows->step > next) note_missing_steps(rows->vehicle_id, next, rows->step - 1);
    account(*rows);
    next = rows->step + 1;
  }
  for (const auto& [id, step] : stream_.next_steps())
    if (next_steps[id] < step) note_missing_steps(id, next_steps[id], step - 1);
  for (const std::uint64_t index : read_status_indices(*segment_.earlier)) note_status(index);
}

// --- samples in ----------------------------------------------------------------------------------

void Recording::add(const RecordBatch& batch) {
  if (batch.run_id() == parameters_.run_id()) stream_.add(batch);
}

void Recording::add(const model::StepRecord& record) { stream_.add(record); }

void Recording::add(const SimStatus& status) {
  if (status.run_id() != parameters_.run_id()) return;
  // A server that is discovered again sends its history again.
  if (last_status_ && status.sample_index() <= last_status_->sample_index()) return;
  last_status_ = status;
  // The server's history begins before this segment.
  const bool is_repeated = status.sample_index() < next_status_;
  log_.add(status, is_repeated);
  if (is_repeated) return;
  note_status(status.sample_index());
  for (const auto& sink : sinks_) sink->add(status);
}

void Recording::note_library(const std::string& controller, const std::string& sha256) {
  constexpr std::size_t kMaxNoted = 256;  // limits the memory for announcements
  if (libraries_.size() < kMaxNoted) libraries_.try_emplace(controller, sha256);
}

// --- rows out ------------------------------------------------------------------------------------

void Recording::write(const StepRows& rows) {
  for (const auto& sink : sinks_) sink->add(rows);
  if (rows.is_unanswered()) ++unanswered_steps_;
  account(rows);
  for (const auto& sink : sinks_)
    if (sink->is_full()) return flush();
}

void Recording::account(const StepRows& rows) {
  certificate_.add(rows);
  log_.add(rows);
  const std::uint32_t id = rows.vehicle_id;
  // Only the last step of a failed run may be without an answer. A later step shows that this one
  // was not the last.
  if (!bare_steps_.empty())
    if (const auto bare = bare_steps_.extract(id))
      note_missing_answers(id, bare.mapped(), bare.mapped());
  if (!rows.has_state) note_missing(id, StateRow::kTopic, rows.step, rows.step);
  if (!rows.has_command && !rows.has_reference)
    bare_steps_[id] = rows.step;
  else if (!rows.has_command)
    note_missing(id, CommandRow::kTopic, rows.step, rows.step);
  else if (!rows.has_reference && !rows.is_unanswered())
    note_missing(id, ReferenceRow::kTopic, rows.step, rows.step);
}

void Recording::note_missing_steps(std::uint32_t vehicle_id, std::uint64_t from, std::uint64_t to) {
  note_missing(vehicle_id, StateRow::kTopic, from, to);
  note_missing_answers(vehicle_id, from, to);
}

void Recording::note_missing_answers(std::uint32_t vehicle_id, std::uint64_t from,
                                     std::uint64_t to) {
  note_missing(vehicle_id, CommandRow::kTopic, from, to);
  note_missing(vehicle_id, ReferenceRow::kTopic, from, to);
}

/// Notes the missing steps after the last row of a run that has ended.
void Recording::note_missing_end() {
  if (!has_ended()) return;
  // The last step of a failed run may be missing, because it is not always published.
  const std::uint64_t end = last_status_->step() + (is_finished() ? 1 : 0);
  for (const auto& [id, next] : stream_.next_steps())
    if (next < end) note_missing_steps(id, next, end - 1);
  if (!is_finished()) return;
  for (const auto& [id, step] : bare_steps_) note_missing_answers(id, step, step);
}

/// Notes missing status samples: the server keeps only the last ones for late readers.
void Recording::note_status(std::uint64_t sample_index) {
  if (sample_index > next_status_)
    note_missing(stream_.next_steps().begin()->first, StatusRow::kTopic, next_status_,
                 sample_index - 1);
  next_status_ = std::max(next_status_, sample_index + 1);
}

void Recording::note_missing(std::uint32_t vehicle_id, const char* topic, std::uint64_t from,
                             std::uint64_t to) {
  const auto [last, is_first] = last_gaps_.try_emplace({vehicle_id, topic});
  LastGap& gap = last->second;
  const bool is_new = is_first || gap.to + 1 != from;
  gap.to = to;
  if (is_new) gap.index = missing_.listed.size();
  if (gap.index == MissingSamples::kMaxListed) {
    missing_.further_gaps += is_new ? 1 : 0;
    missing_.further_samples += to - from + 1;
  } else if (is_new) {
    missing_.listed.push_back({vehicle_id, topic, from, to});
  } else {
    missing_.listed[gap.index].to = to;
  }
}

void Recording::flush() {
  // The manifest comes first: a recorder can be killed at any moment, and rows alone do not give
  // the stage starts.
  if (log_.list_stage_starts() != stage_starts_) write_provisional_manifest();
  for (const auto& sink : sinks_) sink->flush();
  flush_time_ = std::chrono::steady_clock::now();
}

void Recording::flush_if_due() {
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - flush_time_;
  if (elapsed.count() >= scenario_.record.flush_s) flush();
}

// --- how far it is -------------------------------------------------------------------------------

bool Recording::is_finished() const {
  return last_status_ && last_status_->phase() == RunPhase::PHASE_FINISHED;
}

bool Recording::has_ended() const {
  return is_finished() || is_reset() ||
         (last_status_ && last_status_->phase() == RunPhase::PHASE_FAILED);
}

// --- the end -------------------------------------------------------------------------------------

bool Recording::finish(const std::string& interruption, std::uint64_t refused_samples,
                       const std::string& outcome) {
  stream_.give_up();
  note_missing_end();
  interruption_ = interruption;
  refused_samples_ = refused_samples;

  Manifest manifest = make_manifest();
  manifest.complete = is_finished() && missing_.empty() && refused_samples == 0;
  manifest.outcome = has_ended()            ? bus::to_string(last_status_->phase())
                     : interruption.empty() ? "lost"
                                            : outcome;
  manifest.reason =
      interruption.empty() && last_status_ ? last_status_->reason().to_string() : interruption;
  manifest.certificate = certificate_.finish();

  if (!interruption.empty()) log_.add_event("recorder: " + interruption);
  if (!missing_.empty()) log_.add_event("recorder: " + describe(missing_));
  std::ostringstream text;
  log_.write(text);
  write_text(segment_.folder / "flight.txt", text.str());
  flush();

  for (const auto& sink : sinks_)
    for (const RecordedFile& file : sink->finish()) manifest.files.push_back(file);
  for (const char* name : {"flight.txt", "scenario.yaml"})
    manifest.files.push_back({segment_.folder / name, 0, false});
  write_manifest(segment_.folder, manifest);
  return manifest.complete;
}

Manifest Recording::make_manifest() const {
  Manifest manifest;
  manifest.parameters = parameters_;
  manifest.scenario_name = scenario_.name;
  if (last_status_) manifest.timing = last_status_->timing().to_string();
  manifest.segment = segment_.number;
  manifest.first_step = segment_.first_step;
  manifest.last_step =
      has_ended() ? last_status_->step()
                  : static_cast<std::uint64_t>(std::max<std::int64_t>(last_complete_step(), 0));
  manifest.missing = missing_;
  manifest.stage_starts = log_.list_stage_starts();
  manifest.unanswered_steps = unanswered_steps_;
  manifest.refused_samples = refused_samples_;
  manifest.dropped = stream_.dropped();
  manifest.libraries = libraries_;
  for (const auto& sink : sinks_) manifest.format_versions.merge(sink->list_versions());
  return manifest;
}

std::string Recording::describe_gaps() const {
  std::string text;
  const auto append = [&](const std::string& gap) { text += (text.empty() ? "" : "; ") + gap; };
  if (!interruption_.empty()) append(interruption_);
  if (has_ended() && !is_finished())
    append(fmt::format("run {}{}{}", bus::to_string(last_status_->phase()),
                       last_status_->reason().size() > 0 ? ": " : "",
                       last_status_->reason().c_str()));
  if (!missing_.empty()) append(describe(missing_));
  if (refused_samples_ > 0)
    append(fmt::format("{} samples lost because the queue was full", refused_samples_));
  return text.empty() ? "the run has not ended" : text;
}

}  // namespace sls::record
