#include "tools/ctl/status_view.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "common/bus/names.hpp"
#include "common/bus/sync_counters.hpp"
#include "common/config/yaml_node.hpp"
#include "common/text/printable.hpp"

namespace sls::ctl {
namespace {

// --- text of a given width -----------------------------------------------------------------------

/// One character on the terminal, in UTF-8.
using Cell = std::string;
using Cells = std::vector<Cell>;

/// The characters of `text`, which any participant may have sent. A question mark stands for
/// what is not printable.
Cells to_cells(const std::string& text) {
  Cells cells;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = text::calc_printable_length(text, i);
    cells.push_back(length > 0 ? text.substr(i, length) : "?");
    i += std::max<std::size_t>(text::calc_utf8_length(text, i), 1);
  }
  return cells;
}

std::string to_text(const Cells& cells) {
  return std::accumulate(cells.begin(), cells.end(), std::string());
}

std::size_t calc_width(const std::string& text) { return to_cells(text).size(); }

/// `text` in at most `width` characters; an ellipsis stands for what is cut off.
std::string cut(const std::string& text, std::size_t width) {
  Cells cells = to_cells(text);
  if (cells.size() > width) {
    cells.resize(width);
    if (width > 0) cells.back() = "…";
  }
  return to_text(cells);
}

std::string pad(const std::string& text, std::size_t width) {
  std::string padded = cut(text, width);
  padded.append(width - calc_width(padded), ' ');
  return padded;
}

constexpr std::size_t kLabelWidth = 12;

/// Adds `label` and beside it `fields`, in as many lines as needed.
void add_fields(std::vector<std::string>& lines, std::size_t columns, const std::string& label,
                const std::vector<std::string>& fields, const std::string& separator = "   ") {
  std::string line = pad(label, kLabelWidth);
  bool is_empty = true;
  for (const std::string& field : fields) {
    if (!is_empty && calc_width(line + separator + field) > columns) {
      lines.push_back(cut(line, columns));
      line.assign(kLabelWidth, ' ');
      is_empty = true;
    }
    line += (is_empty ? "" : separator) + field;
    is_empty = false;
  }
  lines.push_back(cut(line, columns));
}

/// The same for a sentence.
void add_text(std::vector<std::string>& lines, std::size_t columns, const std::string& label,
              const std::string& text) {
  std::vector<std::string> words(1);
  for (const char letter : text) {
    if (letter == ' ')
      words.emplace_back();
    else
      words.back() += letter;
  }
  add_fields(lines, columns, label, words, " ");
}

// --- texts of the status -------------------------------------------------------------------------

std::string find_scenario_name(const Parameters& parameters) {
  try {
    const auto root = config::parse_yaml(parameters.scenario_text().to_string(), "scenario");
    for (std::size_t i = 0; i < root.keys.size(); ++i)
      if (root.keys[i].text == "name" && !root.items[i].text.empty()) return root.items[i].text;
  } catch (const config::ConfigError&) {  // perhaps of another version
  }
  return "unnamed scenario";
}

double calc_sim_time(const Snapshot& snapshot) {
  return static_cast<double>(snapshot.status->step()) *
         static_cast<double>(snapshot.parameters.period_ns()) * 1e-9;
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.npos, end) == 0;
}

std::string describe_phase(const SimStatus& status) {
  const std::string reason = status.reason().to_string();
  return bus::to_string(status.phase()) + (reason.empty() ? "" : ": " + reason);
}

/// Empty while the server publishes, and after the end, when no more status is expected.
std::string describe_silence(const Snapshot& snapshot) {
  if (has_ended(snapshot.status) || snapshot.silence_s < kLongSilence) return "";
  return fmt::format("server {}silent for {:.1f} s", snapshot.server_is_gone ? "gone, " : "",
                     snapshot.silence_s);
}

std::string describe_duration(std::uint64_t nanoseconds) {
  const double value = static_cast<double>(nanoseconds);
  if (nanoseconds == 0) return "-";
  if (value < 1e6) return fmt::format("{:.0f} µs", value * 1e-3);
  if (value < 1e9) return fmt::format("{:.1f} ms", value * 1e-6);
  return fmt::format("{:.2f} s", value * 1e-9);
}

std::string describe_wanted_factor(const Parameters& parameters) {
  return parameters.mode() == SyncMode::MODE_REALTIME
             ? fmt::format("target {}", parameters.real_time_factor())
             : "target none";
}

using bus::Count;

std::vector<Count> list_link_counts(const SyncCounters& counters) {
  return bus::list_counts(
      counters, "",
      {"resent", "late", "held", "fail-safe", "stale", "duplicate", "superseded", "take-overs"});
}

/// Counters that stay 0 in a healthy run.
std::vector<Count> list_trouble_counts(const SyncCounters& counters) {
  return bus::list_counts(counters, "", {"deadline missed", "overflow", "slipped"});
}

std::vector<Count> list_rejected_counts(const SyncCounters& counters) {
  return bus::list_counts(
      counters, "rejected_",
      {"not finite", "run", "force limit", "step", "vehicle", "client", "fault"});
}

std::vector<std::string> to_fields(const std::vector<Count>& counts) {
  std::vector<std::string> fields;
  fields.reserve(counts.size() + 1);
  for (const Count& count : counts)
    fields.push_back(fmt::format("{} {}", count.words, count.value));
  return fields;
}

std::uint64_t calc_sum(const std::vector<Count>& counts) {
  std::uint64_t sum = 0;
  for (const Count& count : counts) sum += count.value;
  return sum;
}

std::vector<Count> keep_nonzero(std::vector<Count> counts) {
  counts.erase(std::remove_if(counts.begin(), counts.end(),
                              [](const Count& count) { return count.value == 0; }),
               counts.end());
  return counts;
}

const char* describe_readiness(const Participant& participant) {
  return participant.done() ? "done" : participant.ready() ? "yes" : "no";
}

std::string describe_last_step(const Participant& participant) {
  return participant.last_complete_step() < 0 ? "-"
                                              : std::to_string(participant.last_complete_step());
}

/// Adds the last reasons. Leaves out the newest if the line "phase" already shows it.
void add_events(std::vector<std::string>& lines, std::size_t columns, const Snapshot& snapshot) {
  const std::string present =
      snapshot.status ? snapshot.status->reason().to_string() : std::string();
  const char* label = "events";
  for (std::size_t i = 0; i < snapshot.events.size(); ++i) {
    const bool is_last = i + 1 == snapshot.events.size();
    if (is_last && !present.empty() && ends_with(snapshot.events[i], present)) continue;
    add_text(lines, columns, std::exchange(label, ""), snapshot.events[i]);
  }
}

// --- participants --------------------------------------------------------------------------------

constexpr std::size_t kTableColumns = 6;
using TableRow = std::array<std::string, kTableColumns>;

std::vector<TableRow> make_table(const std::vector<Participant>& participants) {
  std::vector<TableRow> table = {{"role", "name", "host", "strength", "ready", "last step"}};
  for (const Participant& participant : participants)
    table.push_back({bus::to_string(participant.role()), participant.name().to_string(),
                     participant.host().to_string(),
                     participant.role() == ParticipantRole::ROLE_CONTROLLER
                         ? std::to_string(participant.strength())
                         : "-",
                     describe_readiness(participant), describe_last_step(participant)});
  return table;
}

/// Widths that hold every text. If the row is longer than `columns`, names and hosts are shortened.
std::array<std::size_t, kTableColumns> calc_widths(const std::vector<TableRow>& table,
                                                   std::size_t columns) {
  constexpr std::size_t kName = 1, kHost = 2, kShortest = 6, kGap = 2;
  std::array<std::size_t, kTableColumns> widths{};
  for (const TableRow& row : table)
    for (std::size_t i = 0; i < kTableColumns; ++i)
      widths[i] = std::max(widths[i], calc_width(row[i]));
  const auto calc_total = [&] {
    return std::accumulate(widths.begin(), widths.end(), kGap * (kTableColumns - 1));
  };
  while (calc_total() > columns && std::max(widths[kName], widths[kHost]) > kShortest)
    --(widths[kHost] >= widths[kName] ? widths[kHost] : widths[kName]);
  return widths;
}

void add_participants(std::vector<std::string>& lines, std::size_t columns,
                      const std::vector<Participant>& participants) {
  lines.emplace_back();
  if (participants.empty()) {
    lines.push_back(cut("no participants", columns));
    return;
  }
  const auto table = make_table(participants);
  const auto widths = calc_widths(table, columns);
  for (const TableRow& row : table) {
    std::string line;
    for (std::size_t i = 0; i < kTableColumns; ++i) {
      const bool is_last = i + 1 == kTableColumns;
      line += is_last ? cut(row[i], widths[i]) : pad(row[i], widths[i]) + "  ";
    }
    lines.push_back(cut(line, columns));
  }
}

}  // namespace

bool has_ended(const std::optional<SimStatus>& status) {
  return status &&
         (status->phase() == RunPhase::PHASE_FINISHED || status->phase() == RunPhase::PHASE_FAILED);
}

std::vector<std::string> render(const Snapshot& snapshot, std::size_t columns) {
  const Parameters& parameters = snapshot.parameters;
  std::vector<std::string> lines;
  lines.push_back(cut(
      fmt::format("{}, vehicle {}, run {:016x}, {}, period {} s", find_scenario_name(parameters),
                  snapshot.vehicle_id, parameters.run_id(), bus::to_string(parameters.mode()),
                  static_cast<double>(parameters.period_ns()) * 1e-9),
      columns));
  const std::string silence = describe_silence(snapshot);
  if (!silence.empty()) add_text(lines, columns, "warning", silence);
  if (!snapshot.status) {
    add_text(lines, columns, "phase", "no status yet");
    add_participants(lines, columns, snapshot.participants);
    return lines;
  }
  const SimStatus& status = *snapshot.status;
  const SyncCounters& counters = status.counters();
  add_text(lines, columns, "phase", describe_phase(status));
  if (status.problem().size() > 0)
    add_text(lines, columns, "problem", status.problem().to_string());
  add_fields(lines, columns, "time",
             {fmt::format("step {}", status.step()),
              fmt::format("{:.3f} s simulated", calc_sim_time(snapshot))});
  add_fields(lines, columns, "pace",
             {fmt::format("real-time factor {:.3g}", status.real_time_factor()),
              describe_wanted_factor(parameters)});
  add_text(lines, columns, "timing", status.timing().to_string());
  add_fields(lines, columns, "round trip",
             {"p50 " + describe_duration(status.round_trip_p50_ns()),
              "p99 " + describe_duration(status.round_trip_p99_ns())});
  add_fields(lines, columns, "answers", to_fields(list_link_counts(counters)));
  const auto rejected = list_rejected_counts(counters);
  auto rejected_fields = to_fields(keep_nonzero(rejected));
  rejected_fields.insert(rejected_fields.begin(), std::to_string(calc_sum(rejected)));
  add_fields(lines, columns, "rejected", rejected_fields);
  const auto trouble = keep_nonzero(list_trouble_counts(counters));
  if (!trouble.empty()) add_fields(lines, columns, "trouble", to_fields(trouble));
  add_events(lines, columns, snapshot);
  add_participants(lines, columns, snapshot.participants);
  return lines;
}

std::string render_line(const Snapshot& snapshot) {
  const Parameters& parameters = snapshot.parameters;
  std::string line = fmt::format("{} {:016x}", find_scenario_name(parameters), parameters.run_id());
  if (snapshot.status) {
    const SimStatus& status = *snapshot.status;
    line += fmt::format(" | {} | step {} | {:.3f} s | factor {:.3g} | round trip {} / {}",
                        describe_phase(status), status.step(), calc_sim_time(snapshot),
                        status.real_time_factor(), describe_duration(status.round_trip_p50_ns()),
                        describe_duration(status.round_trip_p99_ns()));
    for (const auto& counts :
         {list_link_counts(status.counters()), list_trouble_counts(status.counters())})
      for (const std::string& field : to_fields(keep_nonzero(counts))) line += " | " + field;
    const auto rejected = calc_sum(list_rejected_counts(status.counters()));
    if (rejected > 0) line += fmt::format(" | rejected {}", rejected);
    if (status.problem().size() > 0) line += " | problem: " + status.problem().to_string();
  }
  const std::string silence = describe_silence(snapshot);
  if (!silence.empty()) line += " | " + silence;
  return to_text(to_cells(line));
}

std::string to_json(const Snapshot& snapshot) {
  using Json = nlohmann::ordered_json;
  const Parameters& parameters = snapshot.parameters;
  const auto add_counts = [](Json& object, const std::vector<Count>& counts) {
    for (const Count& count : counts) object[bus::to_counter_name(count.words)] = count.value;
  };
  Json json;
  json["scenario"] = find_scenario_name(parameters);
  json["scenario_sha256"] = parameters.scenario_sha256().to_string();
  json["version"] = parameters.version().to_string();
  json["run_id"] = fmt::format("{:016x}", parameters.run_id());
  json["vehicle_id"] = snapshot.vehicle_id;
  json["mode"] = bus::to_string(parameters.mode());
  json["period_ns"] = parameters.period_ns();
  json["server_silent_s"] = snapshot.silence_s;
  json["server_is_gone"] = snapshot.server_is_gone;
  // Lockstep has no target.
  json["real_time_factor_wanted"] =
      parameters.mode() == SyncMode::MODE_REALTIME ? Json(parameters.real_time_factor()) : Json();
  if (snapshot.status) {
    const SimStatus& status = *snapshot.status;
    json["phase"] = bus::to_string(status.phase());
    json["reason"] = status.reason().to_string();
    json["problem"] = status.problem().to_string();
    json["step"] = status.step();
    json["sim_time_s"] = calc_sim_time(snapshot);
    json["real_time_factor"] = status.real_time_factor();
    json["timing"] = status.timing().to_string();
    json["round_trip_p50_ns"] = status.round_trip_p50_ns();
    json["round_trip_p99_ns"] = status.round_trip_p99_ns();
    json["controller"] = status.controller_name().to_string();
    json["counters"] = Json::object();
    add_counts(json["counters"], list_link_counts(status.counters()));
    add_counts(json["counters"], list_trouble_counts(status.counters()));
    json["rejected"] = Json::object();
    add_counts(json["rejected"], list_rejected_counts(status.counters()));
  }
  json["events"] = snapshot.events;
  json["participants"] = Json::array();
  for (const Participant& participant : snapshot.participants)
    json["participants"].push_back({{"role", bus::to_string(participant.role())},
                                    {"name", participant.name().to_string()},
                                    {"host", participant.host().to_string()},
                                    {"strength", participant.strength()},
                                    {"ready", participant.ready()},
                                    {"done", participant.done()},
                                    {"last_complete_step", participant.last_complete_step()}});
  return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

}  // namespace sls::ctl
