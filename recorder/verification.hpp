/// `sls verify`: compares a recording with its manifest, and two recordings with each other.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "recorder/recording_reader.hpp"

namespace sls::record {

/// The result of reading every file of a recording again.
struct Inspection {
  std::uint64_t steps = 0;            ///< of the vehicle with the most steps
  std::string certificate;            ///< of the rows; empty if they cannot be read
  std::vector<std::string> problems;  ///< where a file differs from its manifest, one line each
};
Inspection inspect(const OpenedRecording& flight);

/// The first row or field, in step order, in which the data of two recordings differ.
struct Difference {
  std::uint64_t step = 0;
  std::string text;  ///< file, vehicle, step, column and both values
};
/// @throws DamagedError if a row that is read before the first difference is damaged.
std::optional<Difference> find_first_difference(const OpenedRecording& a, const OpenedRecording& b);

/// The largest difference of a column over the steps that both recordings have.
struct Deviation {
  std::string column;  ///< `state.csv, load_x_m`
  double largest =
      0;  ///< |A − B|; 0: bits alone differ, as of −0 and 0; NaN: one is not a number, or a text
  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;  ///< of the largest; of the first if there is none
};
/// One entry for each column that differs, in the order of the files.
/// @throws DamagedError
std::vector<Deviation> list_deviations(const OpenedRecording& a, const OpenedRecording& b);
std::string describe(const Deviation& deviation);

/// Differences and gaps according to the manifests. The data can still be equal.
std::vector<std::string> list_notes(const OpenedRecording& a, const OpenedRecording& b);

}  // namespace sls::record
