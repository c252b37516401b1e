/// The version of this build, and of what it stands on.
#pragma once

#include <string>

namespace sls::app {

/// "sls 0.1.0".
std::string version();

/// "3.4.0": the version of Eigen this was built with.
std::string eigen_version();

/// "Debian GNU/Linux 12 (bookworm)", of /etc/os-release; "unknown" without one.
std::string system_name();

}  // namespace sls::app
