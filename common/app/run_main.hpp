/// The common part of every main: options, log, signals, exit codes.
#pragma once

#include <functional>
#include <string>

#include "common/app/command_line.hpp"

namespace sls::app {

/// Exit codes of all programs. Interrupted: 130 (SIGINT), 143 (SIGTERM) or 129 (SIGHUP).
inline constexpr int kExitDone = 0;       ///< The work is done.
inline constexpr int kExitRunFailed = 1;  ///< The run failed, or the comparison found a difference.
inline constexpr int kExitBadUsage = 2;   ///< The command line or a file is wrong.

/// Parses the command line by `cli`, starts log and signal handling, calls `work` and returns the
/// exit code: 0 without an exception, 2 for config::ConfigError, 1 for any other exception, 128 and
/// its number after a stop signal. An exception is printed as one line on stderr, also one of
/// another thread, which ends the process at once.
int run_main(int argc, char** argv, CommandLine& cli, const CommonOptions& options,
             const std::string& program, const std::function<void()>& work);

}  // namespace sls::app
