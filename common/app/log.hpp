#pragma once

#include <string>

namespace sls::app {

/// Makes spdlog's default logger write one line per event on stderr: `PROGRAM: message`,
/// `PROGRAM: warning: message` or `PROGRAM: error: message`. `level` is the least severe level
/// that is written: debug, info, warning or error.
void start_log(const std::string& program, const std::string& level);

}  // namespace sls::app
