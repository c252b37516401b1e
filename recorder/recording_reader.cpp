#include "recorder/recording_reader.hpp"

#include <algorithm>
#include <charconv>
#include <string>
#include <type_traits>

#include "common/config/config_error.hpp"
#include "common/config/yaml_node.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;

struct FieldParser {
  const CsvReader& file;
  std::size_t index = 0;

  template <class Field>
  void operator()(const Column&, Field& field) {
    for_each_component(field, [this](auto& component) { this->parse(component); });
  }
  void operator()(const Column&, model::Numbers& signals) {
    const std::size_t count = file.columns().size() - index;
    if (count > model::kMaxNumbers)
      throw DamagedError(file.place() + "expected at most " + std::to_string(model::kMaxNumbers) +
                         " signals, got " + std::to_string(count));
    signals.resize(static_cast<Eigen::Index>(count));
    for (double& number : signals) parse(number);
  }

  template <class Number>
  void parse(Number& number) {
    const std::string_view text = file.fields()[index];
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size())
      throw DamagedError(file.place() + config::to_printable(file.columns()[index]) +
                         ": expected a number, got '" + config::to_printable(std::string(text)) +
                         "'");
    ++index;
  }
  void parse(std::string& text) { text = file.fields()[index++]; }
};

template <class Row>
constexpr bool kHasMotion = std::is_same_v<Row, StateRow> || std::is_same_v<Row, MeasuredRow>;
template <class Row>
constexpr auto kFurther =
    kHasMotion<Row> ? CsvReader::Further::kAllowed : CsvReader::Further::kNone;

template <class Row>
std::string make_known_header() {
  return make_header<std::conditional_t<kHasMotion<Row>, StateRow, Row>>();
}

/// Sets kind and error code of the answer by the column `fault`.
void set_fault(StepRows& rows) {
  rows.kind = rows.fault == StepRows::kHeld       ? model::AnswerKind::kHeld
              : rows.fault == StepRows::kFailSafe ? model::AnswerKind::kFailSafe
                                                  : model::AnswerKind::kAccepted;
  for (const model::ErrorCode fault :
       {model::ErrorCode::kFreeFall, model::ErrorCode::kRodLevel, model::ErrorCode::kNotFinite,
        model::ErrorCode::kStageTimeout})
    if (rows.fault == to_string(fault)) rows.answer.error_code = fault;
}

template <class Row>
StepRows parse_row(const CsvReader& file) {
  StepRows rows;
  const auto& columns = file.columns();
  if constexpr (kHasMotion<Row>)
    rows.has_attitude =
        columns.size() >= 29 && columns[22] == "att_w" && columns[28] == "rate_z_rad_s";
  if constexpr (std::is_same_v<Row, MeasuredRow>) rows.measured.emplace();
  FieldParser parser{file};
  Row::visit(rows, parser);
  if constexpr (std::is_same_v<Row, CommandRow>) set_fault(rows);
  return rows;
}

}  // namespace

std::string name_segment(int number) { return "segment-" + std::to_string(number); }

OpenedRecording open_recording(const fs::path& folder) {
  OpenedRecording flight{folder, {{folder, read_manifest(folder)}}};
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
RowReader<Row>::RowReader(const OpenedRecording& flight, std::uint64_t end)
    : flight_(flight), end_(end) {
  for (const std::uint32_t id : flight.vehicle_ids()) vehicles_[id];
}

template <class Row>
const StepRows* RowReader<Row>::peek(std::uint32_t vehicle_id) {
  const auto vehicle = vehicles_.find(vehicle_id);
  if (vehicle == vehicles_.end()) return nullptr;
  const auto& rows = vehicle->second.rows;
  while (rows.empty())
    if (!read_row()) return nullptr;
  return &rows.front();
}

template <class Row>
void RowReader<Row>::take(std::uint32_t vehicle_id, StepRows& rows) {
  auto& waiting = vehicles_.at(vehicle_id).rows;
  StepRows& row = waiting.front();
  if constexpr (std::is_same_v<Row, StateRow>) {
    rows.has_state = true;
    rows.has_attitude = row.has_attitude;
    rows.state_time_s = row.state_time_s;
    rows.truth = row.truth;
    rows.f_Q_W = row.f_Q_W;
  } else if constexpr (std::is_same_v<Row, MeasuredRow>) {
    rows.measured = row.measured;
  } else if constexpr (std::is_same_v<Row, CommandRow>) {
    rows.has_command = true;
    rows.kind = row.kind;
    rows.fault = std::move(row.fault);
    rows.compute_us = row.compute_us;
    rows.client_name = std::move(row.client_name);
    rows.answer.f_Q_W = row.answer.f_Q_W;
    rows.answer.error_code = row.answer.error_code;
  } else {
    rows.has_reference = true;
    rows.reference_time_s = row.reference_time_s;
    rows.answer.reference = row.answer.reference;
    rows.answer.stage = row.answer.stage;
    rows.answer.stage_name = std::move(row.answer.stage_name);
  }
  waiting.pop_front();
}

template <class Row>
std::optional<std::uint32_t> RowReader<Row>::read_on() {
  kept_.reset();
  while (!kept_ && read_row()) {
  }
  return kept_;
}

/// A segment whose measured states are the true ones has no measured.csv.
template <class Row>
bool RowReader<Row>::is_left_out() const {
  return std::is_same_v<Row, MeasuredRow> &&
         !fs::exists(flight_.segments[segment_].folder / Row::kFile);
}

/// Reads one row of any vehicle; false at the end.
template <class Row>
bool RowReader<Row>::read_row() {
  for (; segment_ < flight_.segments.size(); ++segment_, file_.reset()) {
    if (is_left_out()) continue;
    if (!file_)
      file_ = std::make_unique<CsvReader>(flight_.segments[segment_].folder / Row::kFile,
                                          make_known_header<Row>(), kFurther<Row>);
    if (!file_->next()) continue;
    keep(parse_row<Row>(*file_));
    return true;
  }
  return false;
}

template <class Row>
void RowReader<Row>::keep(StepRows row) {
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

template class RowReader<MeasuredRow>;

StepReader::StepReader(const OpenedRecording& flight, std::uint64_t end)
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
  if (rows && rows->has_state) written_.reset();
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
  const auto take = [&](auto& reader) {
    if (step_of(reader.peek(vehicle_id)) == rows.step) reader.take(vehicle_id, rows);
  };
  take(states_);
  take(commands_);
  take(references_);
  return rows;
}

std::uint64_t find_next_step(const OpenedRecording& flight) {
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

std::vector<std::uint64_t> read_status_indices(const OpenedRecording& flight) {
  std::vector<std::uint64_t> indices;
  for (const RecordedSegment& segment : flight.segments) {
    CsvReader file(segment.folder / StatusRow::kFile, "sample_index", CsvReader::Further::kAllowed);
    while (file.next()) FieldParser{file}.parse(indices.emplace_back());
  }
  return indices;
}

}  // namespace sls::record
