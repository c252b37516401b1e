/// The command line of sim_ctl.
#pragma once

#include <cstdint>
#include <optional>

#include "common/app/command_line.hpp"
#include "common/bus/topics.hpp"

namespace sls::ctl {

struct Options {
  app::CommonOptions common;
  std::uint32_t vehicle_id = 0;
  double timeout_s = 10.0;              ///< to find a server, and again for its reply
  std::optional<ControlAction> action;  ///< none: show the status
  std::uint64_t steps = 0;              ///< of ControlAction::ACTION_STEP
  bool watch = false;                   ///< show the status until the run has ended
  bool json = false;                    ///< print the status as JSON
};

/// Declares flags and subcommands; `options` must outlive `cli`'s parsing.
void add_options(CLI::App& cli, Options& options);

}  // namespace sls::ctl
