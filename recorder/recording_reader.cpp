#include "recorder/recording_reader.hpp"

#include <algorithm>
#include <charconv>
#include <string>
#include <type_traits>

#include "common/config/config_error.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;

struct FieldParser {
  const CsvReader& file;
  std::size_t index = 0;

  template <class Field>
  void operator()(const Column&, Field& field) {
    for_each_component(field, [this](auto& component) { parse(component); });
  }
  void operator()(const Column&, std::vector<double>& signals) {
    signals.resize(file.columns().size() - index);
    for (double& number : signals) parse(number);
  }

  template <class Number>
  void parse(Number& number) {
    const std::string_view text = file.fields()[index];
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size())
      throw DamagedError(file.place() + file.columns()[index] + ": expected a number, got '" +
                         std::string(text) + "'");
    ++index;
  }
  void parse(std::string& text) { text = file.fields()[index++]; }
};

template <class Row>
constexpr auto kFurther =
    std::is_same_v<Row, StateRow> ? CsvReader::Further::kAllowed : CsvReader::Further::kNone;

template <class Row>
Row parse_row(const CsvReader& file) {
  Row row;
  const auto& columns = file.columns();
  if constexpr (std::is_same_v<Row, StateRow>)
    row.has_attitude =
        columns.size() >= 29 && columns[22] == "att_w" && columns[28] == "rate_z_rad_s";
  FieldParser parser{file};
  Row::visit(row, parser);
  return row;
}

}  // namespace

std::string name_segment(int number) { return "segment-" + std::to_string(number); }

RecordedFlight open_recording(const fs::path& folder) {
  RecordedFlight flight{folder, {{folder, read_manifest(folder)}}};
  for (int number = 2; fs::exists(folder / name_segment(number) / "manifest.json"); ++number) {
    const fs::path segment = folder / name_segment(number);
    flight.segments.push_back({segment, read_manifest(segment)});
    const ManifestFile &first = flight.segments.front().manifest, &last = flight.manifest();
    if (last.run_id != first.run_id || last.scenario_sha256 != first.scenario_sha256)
      throw config::ConfigError(segment.string() + ": expected a segment of run " + first.run_id +
                                ", got one of run " + last.run_id);
  }
  return flight;
}

template <class Row>
RowReader<Row>::RowReader(const RecordedFlight& flight, std::uint64_t end, const char* file)
    : flight_(flight), end_(end), name_(file) {
  for (const std::uint32_t id : flight.vehicle_ids()) vehicles_[id];
}

template <class Row>
const Row* RowReader<Row>::peek(std::uint32_t vehicle_id) {
  const auto vehicle = vehicles_.find(vehicle_id);
  if (vehicle == vehicles_.end()) return nullptr;
  const auto& rows = vehicle->second.rows;
  while (rows.empty())
    if (!read_row()) return nullptr;
  return &rows.front();
}

template <class Row>
Row RowReader<Row>::take(std::uint32_t vehicle_id) {
  auto& rows = vehicles_.at(vehicle_id).rows;
  Row row = std::move(rows.front());
  rows.pop_front();
  return row;
}

template <class Row>
std::optional<std::uint32_t> RowReader<Row>::read_on() {
  kept_.reset();
  while (!kept_ && read_row()) {
  }
  return kept_;
}

template <class Row>
bool RowReader<Row>::is_left_out() const {
  return name_ != std::string_view(Row::kFile) &&
         !fs::exists(flight_.segments[segment_].folder / name_);
}

/// Reads one row of any vehicle; false at the end.
template <class Row>
bool RowReader<Row>::read_row() {
  for (; segment_ < flight_.segments.size(); ++segment_, file_.reset()) {
    if (is_left_out()) continue;
    if (!file_)
      file_ = std::make_unique<CsvReader>(flight_.segments[segment_].folder / name_,
                                          make_header<Row>(), kFurther<Row>);
    if (!file_->next()) continue;
    keep(parse_row<Row>(*file_));
    return true;
  }
  return false;
}

template <class Row>
void RowReader<Row>::keep(Row row) {
  const auto vehicle = vehicles_.find(row.vehicle_id);
  if (vehicle == vehicles_.end()) return;
  auto& [rows, next_step] = vehicle->second;
  if (row.step < next_step)
    throw DamagedError(file_->place() + "step: expected one after " +
                       std::to_string(next_step - 1) + ", got " + std::to_string(row.step));
  const bool is_last = segment_ + 1 == flight_.segments.size();
  if (row.step >=
      (is_last ? end_ : std::min(end_, flight_.segments[segment_ + 1].manifest.first_step)))
    return;
  next_step = row.step + 1;
  kept_ = row.vehicle_id;
  rows.push_back(std::move(row));
}

template class RowReader<StateRow>;  // for measured.csv

StepReader::StepReader(const RecordedFlight& flight, std::uint64_t end)
    : states_(flight, end), commands_(flight, end), references_(flight, end) {
  const auto ids = flight.vehicle_ids();
  turns_.assign(ids.begin(), ids.end());
}

std::optional<StepRows> StepReader::next() {
  for (; !turns_.empty(); turns_.pop_front())
    if (auto rows = next(turns_.front())) {
      turns_.push_back(turns_.front());
      turns_.pop_front();
      return rows;
    }
  return std::nullopt;
}

std::optional<StepRows> StepReader::next_as_written() {
  if (!written_) written_ = states_.read_on();
  if (!written_) return next();
  auto rows = next(*written_);
  if (rows && rows->state) written_.reset();
  return rows;
}

std::optional<StepRows> StepReader::next(std::uint32_t vehicle_id) {
  constexpr auto kNone = std::numeric_limits<std::uint64_t>::max();
  const auto step_of = [](const auto* row) { return row ? row->step : kNone; };
  StepRows rows;
  rows.vehicle_id = vehicle_id;
  rows.step = std::min({step_of(states_.peek(vehicle_id)), step_of(commands_.peek(vehicle_id)),
                        step_of(references_.peek(vehicle_id))});
  if (rows.step == kNone) return std::nullopt;
  const auto take = [&](auto& reader, auto& row) {
    if (step_of(reader.peek(vehicle_id)) == rows.step) row = reader.take(vehicle_id);
  };
  take(states_, rows.state);
  take(commands_, rows.command);
  take(references_, rows.reference);
  return rows;
}

std::uint64_t find_next_step(const RecordedFlight& flight) {
  std::map<std::uint32_t, std::uint64_t> after_whole;
  for (const std::uint32_t id : flight.vehicle_ids()) after_whole[id] = 0;
  StepReader reader(flight);
  while (const auto rows = reader.next())
    if (rows->is_whole()) after_whole[rows->vehicle_id] = rows->step + 1;
  const auto least = std::min_element(
      after_whole.begin(), after_whole.end(),
      [](const auto& one, const auto& other) { return one.second < other.second; });
  return least == after_whole.end() ? 0 : least->second;
}

std::vector<std::uint64_t> read_status_indices(const RecordedFlight& flight) {
  std::vector<std::uint64_t> indices;
  for (const RecordedSegment& segment : flight.segments) {
    CsvReader file(segment.folder / StatusRow::kFile, "sample_index", CsvReader::Further::kAllowed);
    while (file.next()) FieldParser{file}.parse(indices.emplace_back());
  }
  return indices;
}

}  // namespace sls::record
