#include "recorder/sinks/csv/csv_sink.hpp"

#include <algorithm>

#include "common/sync/servers.hpp"

namespace sls::record {
namespace {

constexpr std::size_t kPendingBytes = 1 << 17;  // less than the size at which a file flushes itself

struct FieldWriter {
  CsvFile& file;

  template <class Field>
  void operator()(const Column&, const Field& field) {
    for_each_component(field, [this](const auto& component) { file.add(component); });
  }
};

template <class Row, class Rows>
void write_row(CsvFile& file, const Rows& rows) {
  FieldWriter writer{file};
  Row::visit(rows, writer);
  file.end_row();
}

}  // namespace

CsvSink::CsvSink(const std::filesystem::path& folder, const Parameters& parameters,
                 const WriteCall& write)
    : folder_(folder),
      write_(write),
      state_header_(make_state_header(parameters)),
      is_of_fleet_(sync::is_fleet(parameters)),
      states_(folder / StateRow::kFile, state_header_, write),
      references_(folder / ReferenceRow::kFile, make_header<ReferenceRow>(), write),
      flight_(folder / FlightRow::kFile, make_flight_header(is_of_fleet_), write),
      statuses_(folder / StatusRow::kFile, make_header<StatusRow, SimStatus>(), write),
      commands_(folder / CommandRow::kFile, make_header<CommandRow>(), write) {}

void CsvSink::add(const StepRows& rows) {
  if (rows.has_state) write_row<StateRow>(states_, rows);
  if (rows.measured) {
    if (!measured_) measured_.emplace(folder_ / MeasuredRow::kFile, state_header_, write_);
    write_row<MeasuredRow>(*measured_, rows);
  }
  if (rows.has_reference) write_row<ReferenceRow>(references_, rows);
  if (rows.is_complete()) write_row<FlightRow>(flight_, FlightRow{rows, is_of_fleet_});
  if (rows.has_command) write_row<CommandRow>(commands_, rows);
}

void CsvSink::add(const SimStatus& status) { write_row<StatusRow>(statuses_, status); }

bool CsvSink::is_full() const {
  return std::any_of(files_.begin(), files_.end(),
                     [](const CsvFile* file) { return file->pending_bytes() >= kPendingBytes; });
}

void CsvSink::flush() {
  if (measured_) measured_->flush();
  for (CsvFile* file : files_) file->flush();
}

std::vector<RecordedFile> CsvSink::finish() {
  flush();
  std::vector<RecordedFile> list;
  for (const CsvFile* file : files_) list.push_back({file->path(), file->rows(), true});
  if (measured_) list.push_back({measured_->path(), measured_->rows(), true});
  return list;
}

}  // namespace sls::record
