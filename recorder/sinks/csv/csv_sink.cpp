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

template <class Row>
void write_row(CsvFile& file, const Row& row) {
  FieldWriter writer{file};
  Row::visit(row, writer);
  file.end_row();
}

}  // namespace

CsvSink::CsvSink(const std::filesystem::path& folder, const Parameters& parameters)
    : folder_(folder),
      state_header_(make_state_header(parameters)),
      is_of_fleet_(sync::is_fleet(parameters)),
      states_(folder / StateRow::kFile, state_header_),
      references_(folder / ReferenceRow::kFile, make_header<ReferenceRow>()),
      flight_(folder / FlightRow::kFile, make_flight_header(is_of_fleet_)),
      statuses_(folder / StatusRow::kFile, make_header<StatusRow>()),
      commands_(folder / CommandRow::kFile, make_header<CommandRow>()) {}

void CsvSink::add(const StepRows& rows) {
  if (rows.state) write_row(states_, *rows.state);
  if (rows.measured) {
    if (!measured_) measured_.emplace(folder_ / StateRow::kMeasuredFile, state_header_);
    write_row(*measured_, *rows.measured);
  }
  if (rows.reference) write_row(references_, *rows.reference);
  if (rows.is_complete())
    write_row(flight_, FlightRow{*rows.state, *rows.command, *rows.reference, is_of_fleet_});
  if (rows.command) write_row(commands_, *rows.command);
}

void CsvSink::add(const SimStatus& status) { write_row(statuses_, StatusRow{status}); }

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
