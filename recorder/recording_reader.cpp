#include "recorder/recording_reader.hpp"

#include <algorithm>
#include <charconv>
#include <string>

#include "common/config/config_error.hpp"
#include "recorder/columns.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;

struct FieldParser {
  const CsvReader& file;
  std::size_t index = 0;

  template <class Number>
  void operator()(Number& number) {
    const std::string_view text = file.fields()[index];
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size())
      throw DamagedError(file.place() + std::string(file.columns()[index]) +
                         ": expected a number, got '" + std::string(text) + "'");
    ++index;
  }
  void operator()(std::string& text) { text = file.fields()[index++]; }
  template <class Field>
  void incidental(Field& field) {
    (*this)(field);
  }
};

template <class Row>
Row parse_row(const CsvReader& file) {
  Row row;
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
RowReader<Row>::RowReader(const RecordedFlight& flight, std::uint32_t vehicle_id, std::uint64_t end)
    : flight_(flight), vehicle_id_(vehicle_id), end_(end) {
  advance();
}

template <class Row>
void RowReader<Row>::advance() {
  for (; segment_ < flight_.segments.size(); ++segment_) {
    if (!file_)
      file_ =
          std::make_unique<CsvReader>(flight_.segments[segment_].folder / Row::kFile, Row::kHeader);
    if (read_from_segment()) return;
    file_.reset();
  }
  row_.reset();
}

template <class Row>
bool RowReader<Row>::read_from_segment() {
  const bool is_last = segment_ + 1 == flight_.segments.size();
  const std::uint64_t end =
      is_last ? end_ : std::min(end_, flight_.segments[segment_ + 1].manifest.first_step);
  while (file_->next()) {
    Row row = parse_row<Row>(*file_);
    if (row.vehicle_id != vehicle_id_) continue;
    if (row_ && row.step <= row_->step)
      throw DamagedError(file_->place() + "step: expected one after " + std::to_string(row_->step) +
                         ", got " + std::to_string(row.step));
    if (row.step >= end) return false;
    row_ = std::move(row);
    return true;
  }
  return false;
}

StepReader::StepReader(const RecordedFlight& flight, std::uint32_t vehicle_id, std::uint64_t end)
    : vehicle_id_(vehicle_id),
      states_(flight, vehicle_id, end),
      commands_(flight, vehicle_id, end),
      references_(flight, vehicle_id, end) {}

std::optional<StepRows> StepReader::next() {
  constexpr auto kNone = std::numeric_limits<std::uint64_t>::max();
  const auto step_of = [](const auto& row) { return row ? row->step : kNone; };
  StepRows rows;
  rows.vehicle_id = vehicle_id_;
  rows.step =
      std::min({step_of(states_.peek()), step_of(commands_.peek()), step_of(references_.peek())});
  if (rows.step == kNone) return std::nullopt;
  const auto take = [&](auto& reader, auto& row) {
    if (step_of(reader.peek()) != rows.step) return;
    row = reader.peek();
    reader.advance();
  };
  take(states_, rows.state);
  take(commands_, rows.command);
  take(references_, rows.reference);
  return rows;
}

std::uint64_t find_next_step(const RecordedFlight& flight) {
  std::uint64_t next = std::numeric_limits<std::uint64_t>::max();
  for (const std::uint32_t id : flight.vehicle_ids()) {
    std::uint64_t after_whole = 0;
    StepReader reader(flight, id);
    while (const auto rows = reader.next())
      if (rows->is_whole()) after_whole = rows->step + 1;
    next = std::min(next, after_whole);
  }
  return flight.vehicle_ids().empty() ? 0 : next;
}

std::vector<std::uint64_t> read_status_indices(const RecordedFlight& flight) {
  std::vector<std::uint64_t> indices;
  for (const RecordedSegment& segment : flight.segments) {
    CsvReader file(segment.folder / kStatusFile, make_status_header());
    while (file.next()) FieldParser{file}(indices.emplace_back());
  }
  return indices;
}

}  // namespace sls::record
