/// The time at which the server wrote each sample of sls/state, by the server's clock.
#pragma once

#include <cstddef>
#include <filesystem>

namespace sls::bench {

struct StampsOptions {
  std::filesystem::path qos_file;
  int domain = 0;
  /// True: reads new samples with the loop's reader profile, until no more come. False: requests
  /// the history that the writer keeps; use it in a pause, where it does not disturb the run.
  bool is_live = false;
};

/// Prints a line "step,written_ns" for each sample, in the order in which they came.
/// @throws app::RunError if no sample comes.
void print_stamps(const StampsOptions& options);

}  // namespace sls::bench
