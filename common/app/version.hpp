/// The version of this build.
#pragma once

#include <string>

namespace sls::app {

/// "sls 0.1.0".
std::string version();

}  // namespace sls::app
