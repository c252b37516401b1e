/// When each sample of a run was written, by the clock of who wrote it.
#pragma once

#include <cstddef>
#include <filesystem>

namespace sls::bench {

struct StampsOptions {
  std::filesystem::path qos_file;
  int domain = 0;
  /// Listens as a loop does, from now on, until the run is silent; else it asks for the histories
  /// that the writers keep, of a run that is paused: that does not disturb it while it flies.
  bool is_live = false;
};

/// Prints a line "topic,step,written_ns" for each sample of vehicle 0, in the order in which they
/// came; stages of a run begin anew at smaller steps.
/// @throws app::RunError if nothing comes.
void print_stamps(const StampsOptions& options);

}  // namespace sls::bench
