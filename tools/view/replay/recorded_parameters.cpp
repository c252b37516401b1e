#include "tools/view/replay/recorded_parameters.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <charconv>
#include <set>
#include <string>

#include "common/bus/convert.hpp"
#include "common/bus/names.hpp"
#include "common/config/scenario_reader.hpp"
#include "recorder/columns.hpp"
#include "recorder/rows.hpp"
#include "recorder/sinks/csv/csv_reader.hpp"

namespace sls::view {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostSignals = 64;  // MOST_NUMBERS of idl/sls.idl

std::uint64_t parse_run_id(const std::string& text, const fs::path& folder) {
  std::uint64_t run_id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), run_id, 16);
  if (error != std::errc() || end != text.data() + text.size() || text.size() != 16)
    throw config::ConfigError((folder / "manifest.json").string() +
                              ": run_id: expected 16 hex digits, got '" + text + "'");
  return run_id;
}

/// Sets the attitude and the signals from the columns of state.csv beyond those of a point mass.
void set_columns(Parameters& message, const fs::path& folder,
                 const record::ManifestFile& manifest) {
  const record::CsvReader file(folder / record::StateRow::kFile,
                               record::make_header<record::StateRow>(),
                               record::CsvReader::Further::kAllowed);
  record::StepRows with_attitude;
  with_attitude.has_attitude = true;
  const std::string without = record::make_header<record::StateRow>();
  const std::string known =
      record::join_names(record::list_columns<record::StateRow>(with_attitude));
  std::string header;
  for (const std::string& name : file.columns()) header += (header.empty() ? "" : ",") + name;
  message.has_attitude((header + ",").rfind(known + ",", 0) == 0);
  const std::string& before = message.has_attitude() ? known : without;
  const auto count = static_cast<std::size_t>(std::count(before.begin(), before.end(), ',') + 1);
  if (file.columns().size() - count > kMostSignals)
    throw record::DamagedError(fmt::format("{}:1: expected at most {} signals, got {}",
                                           (folder / record::StateRow::kFile).string(),
                                           kMostSignals, file.columns().size() - count));
  for (std::size_t index = count; index < file.columns().size(); ++index) {
    SignalDescription& signal = message.signals().emplace_back();
    signal.name(file.columns()[index]);
    for (const record::ManifestFile::Signal& of_manifest : manifest.signals)
      if (of_manifest.name == file.columns()[index]) signal.unit(of_manifest.unit);
  }
}

void set_vehicles(Parameters& message, const config::Scenario& scenario,
                  const record::OpenedRecording& flight) {
  const auto ids = flight.vehicle_ids();
  for (const std::uint32_t id : std::set<std::uint32_t>(ids.begin(), ids.end())) {
    if (id >= scenario.vehicles.size())
      throw config::ConfigError(
          fmt::format("{}: vehicle_ids: expected ids of the scenario's {} vehicles, got {}",
                      (flight.folder / "manifest.json").string(), scenario.vehicles.size(), id));
    VehicleParameters& item = message.vehicles().emplace_back();
    item.vehicle_id(id);
    bus::fill(item, config::make_vehicle_scenario(scenario, id).vehicle);
  }
  if (message.vehicles().empty())
    throw config::ConfigError((flight.folder / "manifest.json").string() +
                              ": vehicle_ids: expected at least one, got none");
}

}  // namespace

RecordedParameters load_parameters(const record::OpenedRecording& flight) {
  const record::ManifestFile& manifest = flight.segments.front().manifest;
  const fs::path file = flight.folder / "scenario.yaml";
  RecordedParameters parameters;
  parameters.scenario = config::parse_scenario(
      config::read_config_file(file, "the recording's scenario"), file.string());
  Parameters& message = parameters.message;
  message.run_id(parse_run_id(manifest.run_id, flight.folder));
  message.scenario_text(parameters.scenario.text);
  message.scenario_sha256(parameters.scenario.sha256);
  // The manifest has the period of the run: the command line may have replaced the scenario's.
  const auto period_ns = config::to_nanoseconds(manifest.period_s);
  if (!period_ns || *period_ns <= 0)
    throw config::ConfigError(fmt::format("{}: period_s: expected > 0, got {}",
                                          (flight.folder / "manifest.json").string(),
                                          manifest.period_s));
  message.period_ns(*period_ns);
  message.step_ns(std::min(parameters.scenario.plant.step_ns, *period_ns));
  const bool is_lockstep = manifest.mode != bus::to_string(SyncMode::MODE_REALTIME);
  message.mode(is_lockstep ? SyncMode::MODE_LOCKSTEP : SyncMode::MODE_REALTIME);
  message.real_time_factor(is_lockstep ? 0 : parameters.scenario.sync.real_time_factor);
  set_vehicles(message, parameters.scenario, flight);
  set_columns(message, flight.folder, manifest);
  return parameters;
}

}  // namespace sls::view
