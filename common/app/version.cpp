#include "common/app/version.hpp"

namespace sls::app {

std::string version() { return "sls " SLS_VERSION; }

}  // namespace sls::app
