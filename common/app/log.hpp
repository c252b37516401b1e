#pragma once

#include <string>

#include "common/sync/line.hpp"

namespace sls::app {

/// Makes spdlog's default logger write one line per event on stderr: `PROGRAM: message`,
/// `PROGRAM: warning: message` or `PROGRAM: error: message`. `level` is the least severe level
/// that is written: debug, info, warning or error. Controls in a message are escaped
/// (text::escape_controls).
void start_log(const std::string& program, const std::string& level);

/// Logs a line that a core has said, as a warning or for information.
void log(const sync::Line& line);

/// Writes `line` to stdout, with controls escaped, and ends it.
void print(const std::string& line);

}  // namespace sls::app
