/// When each sample of sls/state of a run was written, by the server's clock.
#pragma once

#include <cstddef>
#include <filesystem>

namespace sls::bench {

struct StampsOptions {
  std::filesystem::path qos_file;
  int domain = 0;
  /// Listens as a loop does, from now on, until the run is silent; else it asks for the history
  /// that the writer keeps, of a run that is paused: that does not disturb it while it flies.
  bool is_live = false;
};

/// Prints a line "step,written_ns" for each sample, in the order in which they came.
/// @throws app::RunError if nothing comes.
void print_stamps(const StampsOptions& options);

}  // namespace sls::bench
