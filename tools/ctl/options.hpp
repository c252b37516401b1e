/// The command line of sim_ctl.
#pragma once

#include <cstdint>
#include <optional>

#include "common/app/options.hpp"
#include "common/bus/topics.hpp"

namespace sls::ctl {

struct Options {
  app::CommonOptions common;
  std::uint32_t vehicle_id = 0;
  double timeout_s = 10.0;              ///< for a server to be found, and again for its reply
  std::optional<ControlAction> action;  ///< nothing: show the status
  std::uint64_t steps = 0;              ///< of ACTION_STEP
  bool watch = false;                   ///< of the status
  bool json = false;                    ///< of the status
};

/// Declares flags and subcommands; `options` must outlive `cli`'s parsing.
void add_options(CLI::App& cli, Options& options);

}  // namespace sls::ctl
