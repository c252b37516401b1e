/// A flight flown in this process, with the columns of its recording kept in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "closed_loop/flight.hpp"
#include "closed_loop/flight_recorder.hpp"
#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"

namespace sls::python {

/// Position of a column of a recording's file in the rows.
struct ColumnPlace {
  /// kErrorCode and kStageName: the cell holds an integer code.
  enum class Kind { kDouble, kInteger, kErrorCode, kStageName };

  std::string table;  ///< "state", "measured", "command" or "reference"
  std::string name;   ///< as in the file
  std::size_t index;  ///< of the column's cell in a row
  Kind kind = Kind::kDouble;
};

/// The rows of a vehicle in one block of memory. A cell has 8 bytes: a double or an integer.
class RowBuffer {
 public:
  /// `rows`: expected number of rows.
  RowBuffer(std::size_t width, std::size_t rows) : width_(width) { cells_.reserve(rows * width); }

  /// Adds a row and returns it. The pointer is valid until the next call.
  double* add_row() {
    cells_.resize(cells_.size() + width_);
    return cells_.data() + cells_.size() - width_;
  }

  std::size_t width() const { return width_; }
  std::size_t rows() const { return cells_.size() / width_; }
  const double* row(std::size_t index) const { return cells_.data() + index * width_; }

 private:
  std::size_t width_;
  std::vector<double> cells_;
};

class FlightTable {
 public:
  /// Flies the vehicles `ids` (ascending) of `scenario` to the end. `rest` is called repeatedly and
  /// may throw to end the flight.
  /// @throws config::ConfigError as Flight does.
  /// @throws app::RunError if a control law is broken.
  FlightTable(const config::Scenario& scenario, const std::vector<std::uint32_t>& ids,
              const closed_loop::FlightOptions& options, const std::function<void()>& rest);

  const std::vector<std::uint32_t>& ids() const { return ids_; }
  const std::vector<ColumnPlace>& columns() const { return columns_; }
  /// The rows of the `index`th vehicle.
  const RowBuffer& rows(std::size_t index) const { return rows_[index]; }

  /// Empty if every mission was finished.
  const std::string& failure() const { return failure_; }
  /// True if the measured state of the `index`th vehicle can differ from the true state.
  bool can_measurement_differ(std::size_t index) const { return differs_[index]; }
  /// The last step that has rows.
  std::uint64_t last_step() const { return rows_.front().rows() - 1; }

  /// Certificate of the flight's recording. The first call hashes all rows. Any thread may call it.
  const std::string& calc_certificate() const;

  /// Writes the recording into `folder` as `closed_loop::fly_recorded` does. False if it is not
  /// complete.
  bool save(const std::filesystem::path& folder, bool force) const;

 private:
  struct Remarks {
    std::size_t rows;  // before the remarks
    std::vector<std::string> texts;
  };

  void list_columns(const closed_loop::Flight& flight);
  void keep(const model::StepRecord& flown, std::size_t index);
  void keep_remarks(closed_loop::Flight& flight);
  /// Row `row` of the `index`th vehicle as a step of the flight. The numbers of the law's memory
  /// are missing, because no file of a recording holds them.
  model::StepRecord make_step(std::size_t index, std::size_t row) const;

  const config::Scenario scenario_;
  const std::vector<std::uint32_t> ids_;
  const std::string controller_name_;
  Parameters parameters_;
  bool has_attitude_ = false;
  std::vector<bool> differs_;  // by vehicle: the measured state can differ from the true state
  bool has_measured_ = false;  // true if it can for one vehicle: all vehicles have the same columns
  std::size_t signals_ = 0;
  std::vector<ColumnPlace> columns_;
  std::vector<RowBuffer> rows_;
  std::vector<Remarks> remarks_;
  std::optional<std::size_t> refused_;
  std::string failure_;
  mutable std::once_flag is_certified_;
  mutable std::string certificate_;
};

}  // namespace sls::python
