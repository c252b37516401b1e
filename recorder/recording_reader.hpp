/// Reads recordings back: finds their segments and joins their rows step by step, with constant
/// memory.
#pragma once

#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "recorder/csv_reader.hpp"
#include "recorder/manifest.hpp"
#include "recorder/rows.hpp"

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

/// Rows of one kind and one vehicle, of all segments in order. A segment's rows count up to the
/// step with which the next one takes over.
/// Every member @throws DamagedError.
template <class Row>
class RowReader {
 public:
  RowReader(const RecordedFlight& flight, std::uint32_t vehicle_id, std::uint64_t end);

  /// The row that comes next; nothing at the end.
  const std::optional<Row>& peek() const { return row_; }
  void advance();

 private:
  bool read_from_segment();

  const RecordedFlight& flight_;
  const std::uint32_t vehicle_id_;
  const std::uint64_t end_;
  std::size_t segment_ = 0;
  std::unique_ptr<CsvReader> file_;
  std::optional<Row> row_;
};

/// The steps of one vehicle before `end`, in order; such of which there is no row are left out.
class StepReader {
 public:
  /// @throws DamagedError, like `next`.
  StepReader(const RecordedFlight& flight, std::uint32_t vehicle_id,
             std::uint64_t end = std::numeric_limits<std::uint64_t>::max());

  std::optional<StepRows> next();

 private:
  const std::uint32_t vehicle_id_;
  RowReader<StateRow> states_;
  RowReader<CommandRow> commands_;
  RowReader<ReferenceRow> references_;
};

/// The step after the last one that every vehicle has whole; 0: there is none.
/// @throws DamagedError
std::uint64_t find_next_step(const RecordedFlight& flight);

/// The sample_index of every row of status.csv, of all segments in order.
/// @throws DamagedError
std::vector<std::uint64_t> read_status_indices(const RecordedFlight& flight);

}  // namespace sls::record
