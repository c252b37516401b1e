#pragma once

#include <string>

namespace sls::app {

/// Makes spdlog's default logger write one line per event on stderr: `PROGRAM: message`, with the
/// level before the message where it is a warning or an error. `level`: debug, info, warning,
/// error.
void start_log(const std::string& program, const std::string& level);

}  // namespace sls::app
