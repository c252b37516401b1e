#include "recorder/recording.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <system_error>

#include "common/bus/names.hpp"
#include "common/bus/participants.hpp"
#include "recorder/columns.hpp"

namespace sls::record {
namespace {

constexpr std::size_t kFlushBytes = 1 << 17;  // below that at which a file flushes on its own

constexpr const char* kTopics[] = {StateRow::kTopic, CommandRow::kTopic, ReferenceRow::kTopic};

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream << text;
  stream.close();
  if (!stream)
    throw std::system_error(errno, std::generic_category(), file.string() + ": cannot write");
}

/// Who flew the last step of the `index`th vehicle of the run.
std::string find_last_controller(const SimStatus& status, std::size_t index) {
  return index < status.controller_names().size()
             ? status.controller_names()[index].name().to_string()
             : status.controller_name().to_string();
}

Segment make_only_segment(const std::filesystem::path& folder) {
  Segment segment;
  segment.folder = folder;
  return segment;
}

/// A segment goes on with the run of those before it, which has one scenario.
config::Scenario parse_scenario(const Segment& segment, const Parameters& parameters) {
  if (segment.earlier &&
      segment.earlier->manifest().scenario_sha256 != parameters.scenario_sha256().to_string())
    throw config::ConfigError(fmt::format(
        "{}: expected scenario {} of the earlier segments, got {}", segment.folder.string(),
        segment.earlier->manifest().scenario_sha256, parameters.scenario_sha256().c_str()));
  return config::parse_scenario(parameters.scenario_text().to_string(), "sls/parameters");
}

}  // namespace

Recording::Recording(const std::filesystem::path& folder, const Parameters& parameters)
    : Recording(make_only_segment(folder), parameters) {}

Recording::Recording(const Segment& segment, const Parameters& parameters)
    : segment_(segment),
      parameters_(parameters),
      scenario_(parse_scenario(segment, parameters)),
      states_(segment.folder / StateRow::kFile, StateRow::kHeader),
      commands_(segment.folder / CommandRow::kFile, CommandRow::kHeader),
      references_(segment.folder / ReferenceRow::kFile, ReferenceRow::kHeader),
      statuses_(segment.folder / kStatusFile, make_status_header()),
      flight_(segment.folder / "flight.csv", make_flight_header(bus::is_fleet(parameters))),
      log_(scenario_, parameters) {
  for (const std::uint32_t id : parameters.vehicle_ids())
    vehicles_.emplace(id, StepJoin(
                              [this, id](const StepRecord& record) {
                                rebuilt_commands_ +=
                                    record.origin == AnswerOrigin::kRebuilt ? 1 : 0;
                                write(make_rows(id, record), record.is_answer_expected);
                              },
                              segment.first_step,
                              [this, id](std::uint64_t from, std::uint64_t to) {
                                note_missing_steps(id, from, to);
                              }));
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

/// Certificate, log and gaps speak for the whole flight.
void Recording::read_earlier_segments() {
  if (!segment_.earlier) return;
  log_.set_stage_starts(segment_.earlier->manifest().stage_starts);
  std::map<std::uint32_t, std::uint64_t> next_steps;
  StepReader reader(*segment_.earlier, segment_.first_step);
  while (const auto rows = reader.next()) {
    std::uint64_t& next = next_steps[rows->vehicle_id];
    if (rows->step > next) note_missing_steps(rows->vehicle_id, next, rows->step - 1);
    account(*rows, true);
    next = rows->step + 1;
  }
  for (const auto& [id, vehicle] : vehicles_)
    if (next_steps[id] < segment_.first_step)
      note_missing_steps(id, next_steps[id], segment_.first_step - 1);
  for (const std::uint64_t index : read_status_indices(*segment_.earlier)) note_status(index);
}

// --- samples in ----------------------------------------------------------------------------------

StepJoin* Recording::find_vehicle(std::uint64_t run_id, std::uint32_t vehicle_id) {
  if (run_id != parameters_.run_id()) return nullptr;
  const auto vehicle = vehicles_.find(vehicle_id);
  return vehicle == vehicles_.end() ? nullptr : &vehicle->second;
}

void Recording::add(const VehicleState& state, const bus::PeerId&) {
  if (StepJoin* vehicle = find_vehicle(state.run_id(), state.vehicle_id())) vehicle->add(state);
}

void Recording::add(const ControlCommand& command, const bus::PeerId& sender) {
  if (StepJoin* vehicle = find_vehicle(command.run_id(), command.vehicle_id()))
    vehicle->add(command, sender);
}

void Recording::add(const Reference& reference, const bus::PeerId& sender) {
  if (StepJoin* vehicle = find_vehicle(reference.run_id(), reference.vehicle_id()))
    vehicle->add(reference, sender);
}

void Recording::add(const SimStatus& status, const bus::PeerId&) {
  if (status.run_id() != parameters_.run_id()) return;
  // A server that is discovered again sends its past again.
  if (last_status_ && status.sample_index() <= last_status_->sample_index()) return;
  last_status_ = status;
  note_status(status.sample_index());
  write_row(statuses_, status);
  log_.add(status);
  if (has_ended())
    for (std::size_t i = 0; i < parameters_.vehicle_ids().size(); ++i)
      vehicles_.at(parameters_.vehicle_ids()[i])
          .set_end(status.step(), is_finished(), find_last_controller(status, i));
}

void Recording::pass_time(StepJoin::Duration elapsed) {
  for (auto& [id, vehicle] : vehicles_) vehicle.pass_time(elapsed);
}

// --- rows out ------------------------------------------------------------------------------------

void Recording::write(const StepRows& rows, bool is_answer_expected) {
  if (rows.state) write_row(states_, *rows.state);
  if (rows.reference) write_row(references_, *rows.reference);
  if (rows.is_complete())
    write_flight_row(flight_, *rows.state, *rows.command, *rows.reference,
                     bus::is_fleet(parameters_));
  if (rows.command) {
    write_row(commands_, *rows.command);
    unanswered_steps_ += rows.command->is_unanswered() ? 1 : 0;
  }
  account(rows, is_answer_expected);
  for (const CsvFile* file : files())
    if (file->pending_bytes() >= kFlushBytes) return flush();
}

void Recording::account(const StepRows& rows, bool is_answer_expected) {
  certificate_.add(rows);
  log_.add(rows);
  const auto note = [&](const char* topic) {
    note_missing(rows.vehicle_id, topic, rows.step, rows.step);
  };
  if (!rows.state) note(StateRow::kTopic);
  if (!rows.command && is_answer_expected) note(CommandRow::kTopic);
  if (!rows.reference && is_answer_expected && !(rows.command && rows.command->is_unanswered()))
    note(ReferenceRow::kTopic);
}

void Recording::note_missing_steps(std::uint32_t vehicle_id, std::uint64_t from, std::uint64_t to) {
  for (const char* topic : kTopics) note_missing(vehicle_id, topic, from, to);
}

/// Of status samples the server keeps the last ones alone.
void Recording::note_status(std::uint64_t sample_index) {
  if (sample_index > next_status_)
    note_missing(parameters_.vehicle_id(), kStatusTopic, next_status_, sample_index - 1);
  next_status_ = std::max(next_status_, sample_index + 1);
}

void Recording::note_missing(std::uint32_t vehicle_id, const char* topic, std::uint64_t from,
                             std::uint64_t to) {
  const auto [last, is_first] = last_gaps_.try_emplace({vehicle_id, topic}, missing_.size());
  if (!is_first && missing_[last->second].to + 1 == from) {
    missing_[last->second].to = to;
    return;
  }
  last->second = missing_.size();
  missing_.push_back({vehicle_id, topic, from, to});
}

/// Commands last: where a killed recorder leaves one, the step's other rows are there too.
std::array<CsvFile*, 5> Recording::files() {
  return {&states_, &references_, &flight_, &statuses_, &commands_};
}

void Recording::flush() {
  // Before the rows, which do not tell it: a recorder may be killed at any moment.
  if (log_.list_stage_starts() != stage_starts_) write_provisional_manifest();
  for (CsvFile* file : files()) file->flush();
  flush_time_ = std::chrono::steady_clock::now();
}

void Recording::flush_if_due() {
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - flush_time_;
  if (elapsed.count() >= scenario_.record.flush_s) flush();
}

// --- how far it is -------------------------------------------------------------------------------

bool Recording::is_finished() const {
  return last_status_ && last_status_->phase() == PHASE_FINISHED;
}

bool Recording::has_ended() const {
  return is_finished() || is_reset() || (last_status_ && last_status_->phase() == PHASE_FAILED);
}

bool Recording::has_all() const {
  return has_ended() && std::all_of(vehicles_.begin(), vehicles_.end(),
                                    [](const auto& vehicle) { return vehicle.second.has_ended(); });
}

std::int64_t Recording::last_complete_step() const {
  std::int64_t last = vehicles_.empty() ? -1 : vehicles_.begin()->second.last_step();
  for (const auto& [id, vehicle] : vehicles_) last = std::min(last, vehicle.last_step());
  return last;
}

std::optional<std::string> Recording::describe_stuck(StepJoin::Duration patience) const {
  for (const auto& [id, vehicle] : vehicles_)
    if (const auto stuck = vehicle.describe_stuck(patience))
      return fmt::format("vehicle {}, {}", id, *stuck);
  return std::nullopt;
}

// --- the end -------------------------------------------------------------------------------------

bool Recording::finish(const std::string& interruption, std::uint64_t refused_samples,
                       const std::string& outcome) {
  for (auto& [id, vehicle] : vehicles_) {
    vehicle.give_up();
    if (!has_ended()) continue;
    // Of a failed run's last step there may be nothing: it need not have been published.
    const std::uint64_t end = last_status_->step() + (is_finished() ? 1 : 0);
    const auto next = static_cast<std::uint64_t>(vehicle.last_step() + 1);
    if (next < end) note_missing_steps(id, next, end - 1);
  }
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

  for (const CsvFile* file : files()) manifest.files.push_back({file->path(), file->rows(), true});
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
  manifest.rebuilt_commands = rebuilt_commands_;
  manifest.refused_samples = refused_samples_;
  for (const auto& [id, vehicle] : vehicles_) {
    manifest.dropped.repeated += vehicle.dropped().repeated;
    manifest.dropped.other_client += vehicle.dropped().other_client;
    manifest.dropped.out_of_range += vehicle.dropped().out_of_range;
  }
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
