/// Reads recordings back: finds their segments and joins their rows step by step, in one pass over
/// the files however many vehicles there are. Memory holds the rows that were read before they were
/// asked for: as many as vehicles, or rows of one step, are apart in the files.
#pragma once

#include <deque>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "recorder/manifest.hpp"
#include "recorder/rows.hpp"
#include "recorder/sinks/csv/csv_reader.hpp"

namespace sls::record {

struct RecordedSegment {
  std::filesystem::path folder;
  ManifestFile manifest;
};

/// A recording on disk: its segments in order, at least one.
struct RecordedFlight {
  std::filesystem::path folder;
  std::vector<RecordedSegment> segments;

  const ManifestFile& manifest() const { return segments.back().manifest; }
  std::vector<std::uint32_t> vehicle_ids() const { return segments.front().manifest.vehicle_ids; }
};

/// "segment-2" of a recording's folder.
std::string name_segment(int number);

/// @throws config::ConfigError naming the place if `folder` is no recording, or its segments are
///   not of one run.
RecordedFlight open_recording(const std::filesystem::path& folder);

/// Rows of one kind, of all segments in order, asked for by vehicle. A segment's rows count up to
/// the step with which the next one takes over.
/// Every member @throws DamagedError.
template <class Row>
class RowReader {
 public:
  /// Of a file other than the row's own, segments may have none.
  RowReader(const RecordedFlight& flight, std::uint64_t end, const char* file = Row::kFile);

  /// The vehicle's row that comes next; null at the end.
  const Row* peek(std::uint32_t vehicle_id);
  /// Takes that row, which there must be.
  Row take(std::uint32_t vehicle_id);

  /// Reads one row on: of which vehicle it is; nothing at the end.
  std::optional<std::uint32_t> read_on();

 private:
  bool read_row();
  void keep(Row row);

  struct Vehicle {
    std::deque<Row> rows;  // read, and not asked for yet
    std::uint64_t next_step = 0;
  };

  bool is_left_out() const;

  const RecordedFlight& flight_;
  const std::uint64_t end_;
  const char* const name_;
  std::map<std::uint32_t, Vehicle> vehicles_;
  std::optional<std::uint32_t> kept_;  // vehicle of the row that was read last
  std::size_t segment_ = 0;
  std::unique_ptr<CsvReader> file_;
};

/// The steps before `end`, of each vehicle in order; such of which there is no row are left out.
class StepReader {
 public:
  explicit StepReader(const RecordedFlight& flight,
                      std::uint64_t end = std::numeric_limits<std::uint64_t>::max());

  /// The next step of the vehicle whose turn it is; nothing after the last step of all.
  /// @throws DamagedError, like the other one.
  std::optional<StepRows> next();
  /// The next step of that vehicle; nothing after its last one.
  std::optional<StepRows> next(std::uint32_t vehicle_id);
  /// The next step in the order in which state.csv has them; steps without a state stand before a
  /// later one of their vehicle, or at the end.
  std::optional<StepRows> next_as_written();

 private:
  RowReader<StateRow> states_;
  RowReader<CommandRow> commands_;
  RowReader<ReferenceRow> references_;
  std::deque<std::uint32_t> turns_;       // of vehicles that may have further steps
  std::optional<std::uint32_t> written_;  // vehicle of the state that is next as written
};

/// The step after the last one that every vehicle has whole; 0: there is none.
/// @throws DamagedError
std::uint64_t find_next_step(const RecordedFlight& flight);

/// The sample_index of every row of status.csv, of all segments in order.
/// @throws DamagedError
std::vector<std::uint64_t> read_status_indices(const RecordedFlight& flight);

}  // namespace sls::record
