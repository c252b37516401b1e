#include "recorder/recording.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <sstream>
#include <system_error>

#include "common/app/log.hpp"

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

Recording::Recording(const Segment& segment, const Parameters& parameters, sync::Time now)
    : segment_(segment),
      parameters_(parameters),
      scenario_(parse_scenario(segment, parameters)),
      sinks_(make_sinks(segment.folder, parameters_, scenario_.record, segment.write)),
      log_(scenario_, parameters_),
      core_(parameters_, segment.first_step, scenario_.record.flush_s, now, *this) {
  write_text(segment_.folder / "scenario.yaml", scenario_.text);
  flush();
  if (segment_.earlier) read_earlier_segments();
  write_manifest(core_.make_claims());
}

/// Reads the earlier segments, because certificate, log and gaps cover the whole flight.
void Recording::read_earlier_segments() {
  log_.set_stage_starts(segment_.earlier->manifest().stage_starts);
  StepReader reader(*segment_.earlier, segment_.first_step);
  while (const auto rows = reader.next()) {
    certificate_.add(*rows);
    log_.add(*rows);
    core_.on_earlier_step(*rows);
  }
  core_.on_earlier_end();
  for (const std::uint64_t index : read_status_indices(*segment_.earlier))
    core_.on_earlier_status(index);
}

// --- the core's outputs --------------------------------------------------------------------------

bool Recording::add(const StepRows& rows) {
  for (const auto& sink : sinks_) sink->add(rows);
  certificate_.add(rows);
  log_.add(rows);
  return std::any_of(sinks_.begin(), sinks_.end(),
                     [](const auto& sink) { return sink->is_full(); });
}

void Recording::add(const SimStatus& status, bool is_repeated) {
  log_.add(status, is_repeated);
  if (is_repeated) return;
  for (const auto& sink : sinks_) sink->add(status);
}

void Recording::write_manifest(const Claims& claims) {
  const Manifest manifest = make_manifest(claims);
  record::write_manifest(segment_.folder, manifest);
  stage_starts_ = manifest.stage_starts;
}

void Recording::flush() {
  for (const auto& sink : sinks_) sink->flush();
}

void Recording::log(const sync::Line& line) { app::log(line); }

// --- the end -------------------------------------------------------------------------------------

bool Recording::finish(const std::string& interruption, std::uint64_t refused_samples,
                       const std::string& outcome) {
  Manifest manifest = make_manifest(core_.on_end({interruption, outcome}, refused_samples));
  manifest.certificate = certificate_.finish();
  std::ostringstream text;
  log_.write(text);
  write_text(segment_.folder / "flight.txt", text.str());
  core_.flush();

  for (const auto& sink : sinks_)
    for (const RecordedFile& file : sink->finish()) manifest.files.push_back(file);
  for (const char* name : {"flight.txt", "scenario.yaml"})
    manifest.files.push_back({segment_.folder / name, 0, false});
  record::write_manifest(segment_.folder, manifest);
  return manifest.complete;
}

RecorderCore::Recorded Recording::close(const RunWatch::End& end, std::uint64_t refused_samples) {
  RecorderCore::Recorded recorded;
  recorded.is_complete = finish(end.interruption, refused_samples, end.outcome);
  if (!recorded.is_complete) recorded.gaps = describe_gaps();
  recorded.is_reset = is_reset();
  recorded.last_step = last_complete_step();
  return recorded;
}

Manifest Recording::make_manifest(const Claims& claims) const {
  Manifest manifest;
  static_cast<Claims&>(manifest) = claims;
  manifest.parameters = parameters_;
  manifest.scenario_name = scenario_.name;
  manifest.segment = segment_.number;
  manifest.first_step = segment_.first_step;
  manifest.stage_starts = log_.list_stage_starts();
  for (const auto& sink : sinks_) manifest.format_versions.merge(sink->list_versions());
  return manifest;
}

}  // namespace sls::record
