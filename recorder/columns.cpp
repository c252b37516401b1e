#include "recorder/columns.hpp"

#include <spdlog/fmt/fmt.h>

#include <utility>

#include "common/config/config_error.hpp"
#include "recorder/rows.hpp"

namespace sls::record {
namespace {

bool can_be_column(const std::string& name) {
  constexpr const char* kLetters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
  return !name.empty() && name.find_first_not_of(kLetters) == name.npos;
}

/// Adjacent columns with equal unit, meaning and source share a line.
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
  StepRows rows;
  rows.has_attitude = parameters.has_attitude();
  std::string header = join_names(list_columns<StateRow>(rows));
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
  return join_names(list_columns<FlightRow>(FlightRow{StepRows(), is_of_fleet}));
}

std::string describe_columns() {
  StepRows rows;
  rows.has_attitude = true;
  rows.truth.signals.setZero(1);
  return describe("`state.csv`, `measured.csv`", list_columns<StateRow>(rows)) +
         describe("`command.csv`", list_columns<CommandRow>()) +
         describe("`reference.csv`", list_columns<ReferenceRow>()) +
         describe("`flight.csv`", list_columns<FlightRow>(FlightRow{rows, true})) +
         describe("`status.csv`", list_columns<StatusRow, SimStatus>());
}

}  // namespace sls::record
