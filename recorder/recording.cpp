#include "recorder/recording.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <system_error>

#include "common/bus/names.hpp"
#include "recorder/columns.hpp"

namespace sls::record {
namespace {

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream << text;
  stream.close();
  if (!stream)
    throw std::system_error(errno, std::generic_category(), file.string() + ": cannot write");
}

}  // namespace

Recording::Recording(const std::filesystem::path& folder, const Parameters& parameters)
    : folder_(folder),
      parameters_(parameters),
      scenario_(config::parse_scenario(parameters.scenario_text().to_string(), "sls/parameters")),
      states_(folder / "state.csv", kStateHeader),
      commands_(folder / "command.csv", kCommandHeader),
      references_(folder / "reference.csv", kReferenceHeader),
      statuses_(folder / "status.csv", kStatusHeader),
      flight_(folder / "flight.csv", kFlightHeader),
      log_(scenario_, parameters) {
  for (const std::uint32_t id : parameters.vehicle_ids())
    vehicles_.emplace(id, [this, id](const StepRecord& record) { write(id, record); });
  write_text(folder / "scenario.yaml", scenario_.text);
  flush();
  Manifest manifest;
  manifest.parameters = parameters_;
  manifest.scenario_name = scenario_.name;
  manifest.outcome = "recording";
  manifest.reason = "not finished: the recorder is running, or was killed";
  write_manifest(folder_, manifest);
}

StepJoin* Recording::find_vehicle(std::uint64_t run_id, std::uint32_t vehicle_id) {
  if (run_id != parameters_.run_id()) return nullptr;
  const auto vehicle = vehicles_.find(vehicle_id);
  return vehicle == vehicles_.end() ? nullptr : &vehicle->second;
}

void Recording::add(const VehicleState& state) {
  if (StepJoin* vehicle = find_vehicle(state.run_id(), state.vehicle_id())) vehicle->add(state);
}

void Recording::add(const ControlCommand& command) {
  if (StepJoin* vehicle = find_vehicle(command.run_id(), command.vehicle_id()))
    vehicle->add(command);
}

void Recording::add(const Reference& reference) {
  if (StepJoin* vehicle = find_vehicle(reference.run_id(), reference.vehicle_id()))
    vehicle->add(reference);
}

void Recording::add(const SimStatus& status) {
  if (status.run_id() != parameters_.run_id()) return;
  last_status_ = status;
  write_row(statuses_, status);
  log_.add(status);
  if (has_ended())
    for (auto& [id, vehicle] : vehicles_)
      vehicle.set_end(status.step(), is_finished(), status.controller_name().to_string());
}

bool Recording::is_finished() const { return last_status_.phase() == PHASE_FINISHED; }
bool Recording::has_ended() const { return is_finished() || last_status_.phase() == PHASE_FAILED; }

void Recording::write(std::uint32_t vehicle_id, const StepRecord& record) {
  if (record.state)
    write_row(states_, *record.state);
  else
    note_missing(vehicle_id, "sls/state", record.step);
  if (record.command)
    write_row(commands_, *record.command);
  else if (record.is_answer_expected)
    note_missing(vehicle_id, "sls/command", record.step);
  if (record.reference)
    write_row(references_, *record.reference);
  else if (record.is_answer_expected)
    note_missing(vehicle_id, "sls/reference", record.step);
  if (record.is_complete())
    write_flight_row(flight_, *record.state, *record.command, *record.reference);
  log_.add(record);
}

void Recording::note_missing(std::uint32_t vehicle_id, const char* topic, std::uint64_t step) {
  note_missing_range(vehicle_id, topic, step, step);
}

void Recording::note_missing_range(std::uint32_t vehicle_id, const char* topic, std::uint64_t from,
                                   std::uint64_t to) {
  const auto last =
      std::find_if(missing_.rbegin(), missing_.rend(), [&](const MissingSteps& steps) {
        return steps.vehicle_id == vehicle_id && steps.topic == topic;
      });
  if (last != missing_.rend() && last->to + 1 == from)
    last->to = to;
  else
    missing_.push_back({vehicle_id, topic, from, to});
}

void Recording::flush() {
  for (CsvFile* file : {&states_, &commands_, &references_, &statuses_, &flight_}) file->flush();
  flush_time_ = std::chrono::steady_clock::now();
}

void Recording::flush_if_due() {
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - flush_time_;
  if (elapsed.count() >= scenario_.record.flush_s) flush();
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

bool Recording::finish(const std::string& interruption, std::uint64_t refused_samples) {
  // Of a failed run's last step there may be nothing: it need not have been published.
  const std::uint64_t end = is_finished() ? last_status_.step() + 1 : last_status_.step();
  for (auto& [id, vehicle] : vehicles_) {
    vehicle.give_up();
    const auto next = static_cast<std::uint64_t>(vehicle.last_step() + 1);
    if (has_ended() && next < end) {
      for (const char* topic : {"sls/state", "sls/command", "sls/reference"})
        note_missing_range(id, topic, next, end - 1);
    }
  }
  interruption_ = interruption;
  refused_samples_ = refused_samples;
  const bool complete = is_finished() && missing_.empty() && refused_samples == 0;

  Manifest manifest;
  manifest.parameters = parameters_;
  manifest.scenario_name = scenario_.name;
  manifest.complete = complete;
  manifest.outcome = has_ended()            ? bus::to_string(last_status_.phase())
                     : interruption.empty() ? "lost"
                                            : "interrupted";
  manifest.reason = interruption.empty() ? last_status_.reason().to_string() : interruption;
  manifest.last_step =
      has_ended() ? last_status_.step()
                  : static_cast<std::uint64_t>(std::max<std::int64_t>(last_complete_step(), 0));
  manifest.missing = missing_;
  manifest.refused_samples = refused_samples;

  if (!interruption.empty()) log_.add_event("recorder: " + interruption);
  if (!missing_.empty()) log_.add_event("recorder: " + describe_missing());
  std::ostringstream text;
  log_.write(text);
  write_text(folder_ / "flight.txt", text.str());
  flush();

  for (const CsvFile* file : {&states_, &commands_, &references_, &statuses_, &flight_})
    manifest.files.push_back({file->path(), file->rows(), true});
  for (const char* name : {"flight.txt", "scenario.yaml"})
    manifest.files.push_back({folder_ / name, 0, false});
  write_manifest(folder_, manifest);
  return complete;
}

std::string Recording::describe_gaps() const {
  std::string text;
  const auto append = [&](const std::string& gap) { text += (text.empty() ? "" : "; ") + gap; };
  if (!interruption_.empty()) append(interruption_);
  if (has_ended() && !is_finished())
    append(fmt::format("run failed: {}", last_status_.reason().c_str()));
  if (!missing_.empty()) append(describe_missing());
  if (refused_samples_ > 0)
    append(fmt::format("{} samples lost because the queue was full", refused_samples_));
  return text.empty() ? "the run has not ended" : text;
}

std::string Recording::describe_missing() const {
  std::uint64_t steps = 0;
  for (const MissingSteps& gap : missing_) steps += gap.to - gap.from + 1;
  const MissingSteps& first = missing_.front();
  return fmt::format("{} samples missing, first {} step {} of vehicle {}", steps, first.topic,
                     first.from, first.vehicle_id);
}

}  // namespace sls::record
