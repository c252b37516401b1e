#include "tools/view/replay/recorded_events.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <set>
#include <utility>

#include "recorder/sinks/csv/csv_reader.hpp"

namespace sls::view {
namespace {

namespace fs = std::filesystem;
using record::CsvReader;

constexpr std::uintmax_t kMostLogBytes = 64 << 20;
constexpr std::size_t kMostLineBytes = 4096;  // of flight.txt; the recorder writes shorter lines

double to_time(std::uint64_t step, double period_s) { return static_cast<double>(step) * period_s; }

std::optional<std::uint64_t> parse_step(std::string_view text) {
  std::uint64_t step = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), step);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return step;
}

void read_status(const fs::path& folder, double period_s, std::vector<RecordedEvent>& events) {
  const fs::path path = folder / record::StatusRow::kFile;
  if (!fs::exists(path)) return;
  // Reads only these columns, because recordings of earlier contracts have other counters after
  // them.
  CsvReader file(path, "sample_index,phase,reason,step", CsvReader::Further::kAllowed);
  std::string last;
  while (file.next()) {
    const auto& fields = file.fields();
    std::string text(fields[1]);
    if (!fields[2].empty()) text.append(": ").append(fields[2]);
    if (text == last) continue;
    last = text;
    const auto step = parse_step(fields[3]);
    if (!step)
      throw record::DamagedError(file.place() + "step: expected a number, got '" +
                                 std::string(fields[3]) + "'");
    if (events.size() < kMostMarks)
      events.push_back({*step, to_time(*step, period_s), std::move(text)});
  }
}

/// Reads lines such as "  step 7 (0.028 s): text" below the line "Events".
void read_flight_log(const fs::path& folder, double period_s, std::vector<RecordedEvent>& events) {
  std::set<std::pair<std::uint64_t, std::string>> known;
  for (const RecordedEvent& event : events) known.emplace(event.step, event.text);
  std::error_code error;
  if (!fs::is_regular_file(folder / "flight.txt", error) ||
      fs::file_size(folder / "flight.txt", error) > kMostLogBytes)
    return;
  std::ifstream stream(folder / "flight.txt", std::ios::binary);
  bool is_event = false;
  std::string line;
  for (; std::getline(stream, line) && events.size() < 2 * kMostMarks;) {
    if (line == "Events") {
      is_event = true;
      continue;
    }
    const auto bracket = line.find(" (");
    const auto colon = line.find(" s): ");
    if (!is_event || line.rfind("  step ", 0) != 0 || bracket == line.npos || colon == line.npos ||
        line.size() > kMostLineBytes)
      continue;
    const auto step = parse_step(std::string_view(line).substr(7, bracket - 7));
    std::string text = line.substr(colon + 5);
    if (step && known.emplace(*step, text).second)
      events.push_back({*step, to_time(*step, period_s), std::move(text)});
  }
}

const char* to_string(config::FaultChannel channel) {
  return channel == config::FaultChannel::kState ? "state" : "command";
}

}  // namespace

std::vector<RecordedEvent> read_events(const record::OpenedRecording& flight, double period_s) {
  std::vector<RecordedEvent> events;
  for (const record::RecordedSegment& segment : flight.segments) {
    std::vector<RecordedEvent> of_segment;
    read_status(segment.folder, period_s, of_segment);
    read_flight_log(segment.folder, period_s, of_segment);
    std::move(of_segment.begin(), of_segment.end(), std::back_inserter(events));
  }
  std::stable_sort(events.begin(), events.end(),
                   [](const auto& one, const auto& other) { return one.step < other.step; });
  if (events.size() > kMostMarks) events.resize(kMostMarks);
  return events;
}

std::vector<FaultInterval> list_faults(const config::Scenario& scenario, double end_s) {
  std::vector<FaultInterval> intervals;
  for (const config::Fault& fault : scenario.faults) {
    const double from_s = static_cast<double>(fault.from_ns) / 1e9;
    if (from_s > end_s || intervals.size() == kMostMarks) continue;
    intervals.push_back({from_s, std::min(static_cast<double>(fault.to_ns) / 1e9, end_s),
                         fault.kind, to_string(fault.on),
                         static_cast<std::uint32_t>(fault.vehicle)});
  }
  return intervals;
}

void RowEvents::add(const record::StepRows& rows) {
  Vehicle& vehicle = vehicles_[rows.vehicle_id];
  vehicle.last_step = rows.step;
  if (rows.has_reference && vehicle.stage != rows.answer.stage) {
    vehicle.stage = rows.answer.stage;
    if (stages_.size() < kMostMarks)
      stages_.push_back({rows.vehicle_id, to_time(rows.step, period_s_), rows.answer.stage_name});
  }
  const std::string fault = rows.has_command ? rows.fault : "";
  if (fault == vehicle.fault) return;
  end_fault(rows.vehicle_id, vehicle, rows.step);
  vehicle.fault = fault;
  vehicle.fault_from = rows.step;
}

void RowEvents::end_fault(std::uint32_t vehicle_id, Vehicle& vehicle, std::uint64_t step) {
  const std::string kind = std::exchange(vehicle.fault, "");
  if (kind.empty() || kind == to_string(model::ErrorCode::kNone) || faults_.size() == kMostMarks)
    return;
  faults_.push_back(
      {to_time(vehicle.fault_from, period_s_), to_time(step, period_s_), kind, "", vehicle_id});
}

void RowEvents::finish() {
  for (auto& [id, vehicle] : vehicles_) end_fault(id, vehicle, vehicle.last_step + 1);
}

}  // namespace sls::view
