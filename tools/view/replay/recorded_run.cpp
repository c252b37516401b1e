#include "tools/view/replay/recorded_run.hpp"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "recorder/recording_reader.hpp"
#include "tools/view/replay/kept_rows.hpp"
#include "tools/view/replay/recorded_events.hpp"
#include "tools/view/replay/recorded_parameters.hpp"
#include "tools/view/run_description.hpp"

namespace sls::view {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::string_view kMagic = "SLSVIEW1";
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

template <class Numbers>
void append(std::vector<float>& row, const Numbers& numbers) {
  for (const double number : numbers) row.push_back(static_cast<float>(number));
}

/// Fills `row` with the numbers of kColumns, then with `signals` signals.
void fill_row(std::vector<float>& row, const record::StepRows& rows, std::size_t signals) {
  const model::Measurement& motion = rows.truth;
  const model::RodAngles& rod = motion.rod;
  const Eigen::Quaterniond& q_WB = motion.attitude.q_WB;
  row.clear();
  append(row, motion.p_WQ);
  append(row, motion.v_WQ);
  append(row, motion.p_WL);
  append(row, motion.v_WL);
  append(row, std::array<double, 4>{rod.alpha, rod.beta, rod.alpha_dot, rod.beta_dot});
  append(row, rows.f_Q_W);
  if (rows.has_attitude) {
    append(row, std::array<double, 4>{q_WB.w(), q_WB.x(), q_WB.y(), q_WB.z()});
    append(row, motion.attitude.w_WB_B);
  } else {
    row.resize(row.size() + 7, kNone);
  }
  if (rows.has_reference)
    append(row, rows.answer.reference.position);
  else
    row.resize(row.size() + 3, kNone);
  append(row, motion.signals);
  row.resize(kColumns.size() + signals, kNone);  // another plant in a segment may have others
}

/// Reads rows and events in one pass over the files.
void read_rows(const record::OpenedRecording& flight, std::size_t signals, KeptRows& kept,
               RowEvents& events, const std::function<bool()>& must_stop) {
  record::StepReader reader(flight);
  std::vector<float> row;
  while (const auto rows = reader.next()) {
    if (must_stop()) throw std::runtime_error(flight.folder.string() + ": interrupted");
    if (rows->step >= KeptRows::kMostSteps)
      throw record::DamagedError(fmt::format("{}: step: expected one below {}, got {}",
                                             flight.folder.string(), KeptRows::kMostSteps,
                                             rows->step));
    events.add(*rows);
    if (!rows->has_state) continue;
    fill_row(row, *rows, signals);
    kept.add(rows->vehicle_id, rows->step, rows->state_time_s, row);
  }
  events.finish();
}

Json describe_events(const record::OpenedRecording& flight, double period_s) {
  Json list = Json::array();
  for (const RecordedEvent& event : read_events(flight, period_s))
    list.push_back({{"step", event.step}, {"sim_time_s", event.sim_time_s}, {"text", event.text}});
  return list;
}

Json describe_faults(const config::Scenario& scenario, const RowEvents& events, double end_s) {
  Json list = Json::array();
  std::vector<FaultInterval> intervals = list_faults(scenario, end_s);
  intervals.insert(intervals.end(), events.faults().begin(), events.faults().end());
  for (const FaultInterval& interval : intervals)
    list.push_back({{"from_s", interval.from_s},
                    {"to_s", interval.to_s},
                    {"kind", interval.kind},
                    {"on", interval.on},
                    {"vehicle", interval.vehicle_id}});
  return list;
}

Json describe_stages(const RowEvents& events) {
  Json list = Json::array();
  for (const StageStart& start : events.stages())
    list.push_back(
        {{"vehicle", start.vehicle_id}, {"sim_time_s", start.sim_time_s}, {"name", start.name}});
  return list;
}

/// Rounds the planned path to 0.1 mm; otherwise its digits take half of a small page.
Json describe_flight(const Parameters& parameters) {
  Json run = Json::parse(describe_run(parameters));
  for (Json& point : run.at("path_m"))
    for (Json& component : point) component = std::round(component.get<double>() * 1e4) / 1e4 + 0.0;
  return run;
}

std::string describe_outcome(const record::ManifestFile& manifest) {
  if (manifest.outcome == "recording") return "its recorder was killed, or is still recording";
  return manifest.outcome + (manifest.reason.empty() ? "" : ": " + manifest.reason);
}

std::string name_of(const fs::path& folder) {
  const fs::path absolute = fs::absolute(folder).lexically_normal();
  return (absolute.has_filename() ? absolute : absolute.parent_path()).filename().string();
}

/// Completes `json` with the fields that depend on the rows kept, and returns the head of the file.
std::string make_head(Json& json, const KeptRows& kept) {
  json["every"] = kept.every();
  json["steps_total"] = kept.steps_total();
  json["vehicles"] = Json::array();
  for (const std::uint32_t id : kept.vehicle_ids())
    json["vehicles"].push_back({{"id", id}, {"rows", kept.count_rows(id)}});
  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  const std::size_t fixed = kMagic.size() + sizeof(std::uint32_t);
  text.append((8 - (fixed + text.size()) % 8) % 8, ' ');
  return text;
}

std::string join(const std::string& head, const KeptRows& kept) {
  const auto size = static_cast<std::uint32_t>(head.size());
  std::string bytes(kMagic);
  bytes.append(reinterpret_cast<const char*>(&size), sizeof size);
  bytes += head;
  kept.append_to(bytes);
  return bytes;
}

}  // namespace

std::string load_recorded_run(const fs::path& folder, std::size_t most_bytes,
                              const std::string& name, const std::function<bool()>& must_stop) {
  const record::OpenedRecording flight = record::open_recording(folder);
  const auto [parameters, scenario] = load_parameters(flight);
  const std::size_t signals = parameters.signals().size();
  const double period_s = static_cast<double>(parameters.period_ns()) / 1e9;

  KeptRows kept(flight.vehicle_ids(), kColumns.size() + signals, most_bytes);
  RowEvents events(period_s);
  read_rows(flight, signals, kept, events, must_stop);
  if (kept.steps_total() == 0)
    throw config::ConfigError(folder.string() + ": expected steps of a flight, got none");

  Json json;
  json["run"] = describe_flight(parameters);
  json["name"] = name.empty() ? name_of(folder) : name;
  json["complete"] = flight.manifest().complete;
  json["outcome"] = describe_outcome(flight.manifest());
  json["events"] = describe_events(flight, period_s);
  json["faults"] = describe_faults(scenario, events, kept.last_time_s());
  json["stage_starts"] = describe_stages(events);

  // After thinning the numbers of rows have fewer digits, and `every` has a few more: 64 bytes of
  // reserve.
  const std::size_t head_bytes = make_head(json, kept).size() + 64;
  if (head_bytes > most_bytes || !kept.fit(most_bytes - head_bytes))
    throw config::ConfigError(
        fmt::format("{}: expected a recording whose first and last steps take at most {} bytes, "
                    "got one that takes more",
                    folder.string(), most_bytes));
  return join(make_head(json, kept), kept);
}

}  // namespace sls::view
