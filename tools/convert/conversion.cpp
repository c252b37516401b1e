#include "tools/convert/conversion.hpp"

#include <cmath>
#include <limits>
#include <set>
#include <system_error>

#include "common/config/config_error.hpp"
#include "common/config/scenario_reader.hpp"
#include "recorder/sinks/mcap/mcap_sink.hpp"

namespace sls::convert {
namespace {

namespace fs = std::filesystem;
using config::ConfigError;
using record::StepRows;

/// Those parameters of the recorder on which the content of the MCAP file depends.
Parameters load_parameters(const record::OpenedRecording& flight) {
  const record::ManifestFile& manifest = flight.segments.front().manifest;
  constexpr double kMaxPeriodS = 1e6;
  if (!(manifest.period_s > 0 && manifest.period_s <= kMaxPeriodS))
    throw ConfigError((flight.folder / "manifest.json").string() +
                      ": period_s: expected > 0 and <= 1000000, got " +
                      std::to_string(manifest.period_s));
  Parameters parameters;
  parameters.scenario_sha256(manifest.scenario_sha256);
  parameters.contract_sha256(manifest.contract_sha256);
  parameters.scenario_text(
      config::read_config_file(flight.folder / "scenario.yaml", "the recording's scenario"));
  parameters.period_ns(std::llround(manifest.period_s * 1e9));
  const std::set<std::uint32_t> ids(manifest.vehicle_ids.begin(), manifest.vehicle_ids.end());
  for (const std::uint32_t id : ids) parameters.vehicles().emplace_back().vehicle_id(id);
  for (const record::ManifestFile::Signal& signal : manifest.signals) {
    parameters.signals().emplace_back().name(signal.name);
    parameters.signals().back().unit(signal.unit);
  }
  return parameters;
}

/// True if the manifest of its folder lists `file`.
bool is_listed(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  std::error_code error;
  if (!fs::exists(folder / "manifest.json", error)) return false;
  return record::read_manifest(folder).files.count(file.filename().string()) != 0;
}

void check_output(const fs::path& out, bool force) {
  const std::string place = "--out " + out.string();
  if (out.extension() != ".mcap") throw ConfigError(place + ": expected a name that ends in .mcap");
  std::error_code error;
  if (out.has_parent_path() && !fs::is_directory(out.parent_path(), error))
    throw ConfigError(place + ": expected a folder that exists, got " + out.parent_path().string());
  if (!fs::exists(fs::symlink_status(out, error))) return;
  if (!fs::is_regular_file(out, error))
    throw ConfigError(place + ": expected a file, or a place for a new one");
  if (is_listed(out))
    throw ConfigError(place + ": expected another place: the manifest beside it lists this file, " +
                      "which the recorder wrote (--out FILE)");
  if (!force)
    throw ConfigError(place + ": expected a place for a new file, got one that exists (--force)");
}

/// Adds the measured row of the step to `rows`.
void add_measured(record::RowReader<record::MeasuredRow>& measured, StepRows& rows) {
  StepRows left_out;  // of steps without a state
  for (const StepRows* row = measured.peek(rows.vehicle_id); row && row->step <= rows.step;
       row = measured.peek(rows.vehicle_id))
    measured.take(rows.vehicle_id, row->step == rows.step ? rows : left_out);
}

std::uint64_t write(const record::OpenedRecording& flight, const fs::path& file) {
  record::McapSink sink(file, load_parameters(flight));
  constexpr auto kEnd = std::numeric_limits<std::uint64_t>::max();
  record::StepReader steps(flight, kEnd);
  record::RowReader<record::MeasuredRow> measured(flight, kEnd);
  while (auto rows = steps.next_as_written()) {
    add_measured(measured, *rows);
    sink.add(*rows);
    if (sink.is_full()) sink.flush();
  }
  sink.finish();
  return sink.messages();
}

}  // namespace

fs::path make_default_output(const record::OpenedRecording& flight) {
  return flight.folder / record::McapSink::kFile;
}

std::uint64_t write_mcap(const record::OpenedRecording& flight, const fs::path& out, bool force) {
  check_output(out, force);
  fs::path part = out;
  part += ".part";
  std::error_code ignored;
  fs::remove(part, ignored);  // left by a conversion that was killed
  try {
    const std::uint64_t messages = write(flight, part);
    record::sync_to_disk(part);
    fs::rename(part, out);
    return messages;
  } catch (...) {
    fs::remove(part, ignored);
    throw;
  }
}

}  // namespace sls::convert
