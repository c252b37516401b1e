/// Reads recordings: finds their segments and joins their rows step by step, in one pass over the
/// files for any number of vehicles. Rows that were read before they are requested stay in memory.
/// Their number is the distance in a file between the rows of one step.
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
struct OpenedRecording {
  std::filesystem::path folder;
  std::vector<RecordedSegment> segments;

  const ManifestFile& manifest() const { return segments.back().manifest; }
  std::vector<std::uint32_t> vehicle_ids() const { return segments.front().manifest.vehicle_ids; }
};

/// "segment-2" of a recording's folder.
std::string name_segment(int number);

/// @throws config::ConfigError naming the place if `folder` is no recording, or its segments are
///   not of one run.
OpenedRecording open_recording(const std::filesystem::path& folder);

/// Rows of one kind, of all segments in order, requested by vehicle. The rows of a segment are used
/// up to the first step of the next segment.
/// Every member @throws DamagedError.
template <class Row>
class RowReader {
 public:
  RowReader(const OpenedRecording& flight, std::uint64_t end);

  /// The next row of the vehicle, in a step that has no other row; null at the end.
  const StepRows* peek(std::uint32_t vehicle_id);
  /// Moves that row, which must exist, into `rows`.
  void take(std::uint32_t vehicle_id, StepRows& rows);

  /// Reads one more row and returns its vehicle; nothing at the end.
  std::optional<std::uint32_t> read_on();

 private:
  bool read_row();
  void keep(StepRows row);

  struct Vehicle {
    std::deque<StepRows> rows;  // read, but not taken yet
    std::uint64_t next_step = 0;
  };

  bool is_left_out() const;

  const OpenedRecording& flight_;
  const std::uint64_t end_;
  std::map<std::uint32_t, Vehicle> vehicles_;
  std::optional<std::uint32_t> kept_;  // vehicle of the last row that was kept
  std::size_t segment_ = 0;
  std::unique_ptr<CsvReader> file_;
};

/// The steps before `end`, in order for each vehicle. Steps without any row are left out.
class StepReader {
 public:
  explicit StepReader(const OpenedRecording& flight,
                      std::uint64_t end = std::numeric_limits<std::uint64_t>::max());

  /// The next step; the vehicles take turns. Nothing after the last step of all.
  /// @throws DamagedError, as all members do.
  std::optional<StepRows> next();
  /// The next step of that vehicle; nothing after its last one.
  std::optional<StepRows> next(std::uint32_t vehicle_id);
  /// The next step in the order of state.csv. A step without a state comes before a later step of
  /// its vehicle, or at the end.
  std::optional<StepRows> next_as_written();

 private:
  RowReader<StateRow> states_;
  RowReader<CommandRow> commands_;
  RowReader<ReferenceRow> references_;
  std::deque<std::uint32_t> turns_;       // vehicles that may have further steps
  std::optional<std::uint32_t> written_;  // vehicle of the next row of state.csv
};

/// The step after the last one that is whole for every vehicle; 0: there is none.
/// @throws DamagedError
std::uint64_t find_next_step(const OpenedRecording& flight);

/// The sample_index of every row of status.csv, of all segments in order.
/// @throws DamagedError
std::vector<std::uint64_t> read_status_indices(const OpenedRecording& flight);

}  // namespace sls::record
