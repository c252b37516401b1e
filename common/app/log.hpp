#pragma once

#include <string>

#include "common/sync/line.hpp"

namespace sls::app {

/// Makes spdlog's default logger write one line per event on stderr: `PROGRAM: message`,
/// `PROGRAM: warning: message` or `PROGRAM: error: message`. `level` is the least severe level
/// that is written: debug, info, warning or error.
void start_log(const std::string& program, const std::string& level);

/// Logs a line that a core has said, as a warning or for information.
void log(const sync::Line& line);

}  // namespace sls::app
