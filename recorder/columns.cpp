#include "recorder/columns.hpp"

#include <spdlog/fmt/fmt.h>

#include <utility>

#include "common/config/config_error.hpp"
#include "recorder/rows.hpp"

namespace sls::record {
namespace {

constexpr Column kAttitude{"att_?", "", "attitude: unit quaternion, body to W", "truth.q_WB"};
constexpr Column kBodyRates{"rate_?_rad_s", "rad/s", "body rates, in the body's frame",
                            "truth.w_WB_B_rad_s"};
constexpr Column kSignals{"NAME", "its own", "signal of the plant", "truth.signals"};
constexpr Column kVehicle{"vehicle_id", "", "vehicle, of a fleet alone", "state.csv"};

bool can_be_column(const std::string& name) {
  constexpr const char* kLetters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
  return !name.empty() && name.find_first_not_of(kLetters) == name.npos;
}

/// Neighbours that are alike share a line.
std::string describe(const std::string& files, const std::vector<ColumnLister::Entry>& columns) {
  std::string text =
      files + "\n\n| column | unit | meaning | source |\n| --- | --- | --- | --- |\n";
  std::string names, end;
  for (const auto& [column, of_column] : columns) {
    const std::string next_end =
        fmt::format(" | {} | {} | `{}` |\n", column.unit, column.meaning, column.source);
    if (!names.empty() && next_end != end) text += "| " + std::exchange(names, "") + end;
    end = next_end;
    for (const std::string& name : of_column)
      names += fmt::format("{}`{}`", names.empty() ? "" : ", ", name);
  }
  return text + "| " + names + end + "\n";
}

}  // namespace

void ColumnLister::add(const Column& column, std::size_t size) {
  if (size == 0) return;
  Entry& entry = entries.emplace_back(Entry{column, {}});
  const std::string name = column.name;
  const auto mark = name.find('?');
  if (mark == name.npos) return entry.names.push_back(name);
  for (const char component : std::string_view(size == 4 ? "wxyz" : "xyz"))
    entry.names.push_back(std::string(name).replace(mark, 1, 1, component));
}

std::string join_names(const std::vector<ColumnLister::Entry>& columns) {
  std::string text;
  for (const auto& [column, names] : columns)
    for (const std::string& name : names) text += (text.empty() ? "" : ",") + name;
  return text;
}

std::string make_state_header(const Parameters& parameters) {
  ColumnLister further;
  if (parameters.has_attitude()) {
    further.add(kAttitude, 4);
    further.add(kBodyRates, 3);
  }
  std::string header = make_header<StateRow>();
  if (parameters.has_attitude()) header += "," + join_names(further.entries);
  for (const SignalDescription& signal : parameters.signals()) {
    const std::string name = signal.name().to_string();
    if (!can_be_column(name) || ("," + header + ",").find("," + name + ",") != header.npos)
      throw config::ConfigError(
          fmt::format("sls/parameters: signals: expected a new name of letters, digits and _, got "
                      "'{}'",
                      name));
    header += "," + name;
  }
  return header;
}

std::string make_flight_header(bool is_of_fleet) {
  return make_header<FlightRow>() + (is_of_fleet ? ",vehicle_id" : "");
}

std::string describe_columns() {
  ColumnLister states{list_columns<StateRow>()}, flight{list_columns<FlightRow>()};
  states.add(kAttitude, 4);
  states.add(kBodyRates, 3);
  states.add(kSignals, 1);
  flight.add(kVehicle, 1);
  return describe("`state.csv`, `measured.csv`", states.entries) +
         describe("`command.csv`", list_columns<CommandRow>()) +
         describe("`reference.csv`", list_columns<ReferenceRow>()) +
         describe("`flight.csv`", flight.entries) +
         describe("`status.csv`", list_columns<StatusRow>());
}

}  // namespace sls::record
