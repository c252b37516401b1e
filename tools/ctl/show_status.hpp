#pragma once

#include <ostream>

#include "tools/ctl/operator_client.hpp"

namespace sls::ctl {

struct ShowOptions {
  bool watch = false;
  bool json = false;
  bool terminal = false;  ///< `out` is the terminal: lines have its width, a watch redraws in place
  double timeout_s = 10.0;  ///< a watch fails if its server is gone and silent for longer
};

/// Writes the status of the vehicle's run to `out`, once or, as a watch, until the run has ended.
/// On a terminal a watch redraws a view four times a second; otherwise it writes a line at every
/// change of phase or reason and every second. It continues after a reset and a restart of the
/// server. A stop signal ends it early.
/// @throws app::RunError if there is no server, if a watch loses it, or if `out` cannot be written.
void show_status(const OperatorClient& client, const ShowOptions& options, std::ostream& out);

}  // namespace sls::ctl
