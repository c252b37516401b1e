/// Selects evenly spaced rows of a recording within a size limit, in one pass.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace sls::view {

class KeptRows {
 public:
  /// `most_bytes`: size of the result; up to three times as many are held while rows are added.
  KeptRows(const std::vector<std::uint32_t>& vehicle_ids, std::size_t columns,
           std::size_t most_bytes);

  /// No flight has more steps; a multiple of this number does not overflow.
  static constexpr std::uint64_t kMostSteps = std::uint64_t{1} << 53;

  /// Adds a row. Steps of one vehicle must ascend and be below kMostSteps; `row` has one number for
  /// each column.
  void add(std::uint32_t vehicle_id, std::uint64_t step, double sim_time_s,
           const std::vector<float>& row);

  /// Thins the rows out until they fit into `most_bytes`. Call it once, after the last `add`. False
  /// if the first and last rows alone do not fit.
  bool fit(std::size_t most_bytes);

  /// k: every k-th step is kept, counted from step 0, and the first and last of each vehicle.
  std::uint64_t every() const { return every_; }
  /// Number of rows added for the vehicle with the most rows.
  std::uint64_t steps_total() const;
  double last_time_s() const;
  std::vector<std::uint32_t> vehicle_ids() const;
  std::size_t count_rows(std::uint32_t vehicle_id) const;
  /// For each vehicle, by ascending id: its times as f64, then its rows as f32; little-endian.
  void append_to(std::string& bytes) const;

 private:
  struct Vehicle {
    std::uint64_t rows_added = 0;
    std::vector<std::uint64_t> steps;
    std::vector<double> times;
    std::vector<float> values;
  };

  /// Keeps steps that are multiples of `every`, first and last.
  void thin_out(std::uint64_t every);
  std::size_t count_bytes(std::uint64_t every) const;
  bool is_kept(const Vehicle& vehicle, std::size_t index, std::uint64_t every) const;

  const std::size_t columns_;
  const std::size_t row_bytes_;
  const std::size_t most_held_;
  std::uint64_t every_ = 1;
  std::size_t held_ = 0;
  std::map<std::uint32_t, Vehicle> vehicles_;
};

}  // namespace sls::view
