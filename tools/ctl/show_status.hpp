#pragma once

#include <ostream>

#include "tools/ctl/operator_client.hpp"

namespace sls::ctl {

struct ShowOptions {
  bool watch = false;
  bool json = false;
  bool terminal = false;  ///< `out` is the terminal: lines have its width, a watch redraws in place
  double timeout_s = 10.0;  ///< without its server after which a watch gives up
};

/// Writes what the vehicle's run does to `out`, once or until it has ended: on a terminal a view
/// redrawn four times a second, else a line at every change of phase or reason and every second.
/// Ends early on a stop signal. A watch follows the run beyond a reset and a restart of the server.
/// @throws app::RunError if there is no server, or none any more, or `out` cannot be written.
void show_status(const OperatorClient& client, const ShowOptions& options, std::ostream& out);

}  // namespace sls::ctl
