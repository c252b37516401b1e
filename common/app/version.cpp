#include "common/app/version.hpp"

#include <Eigen/Core>
#include <fstream>

namespace sls::app {

std::string version() { return "sls " SLS_VERSION; }

std::string eigen_version() {
  const auto join = [](int major, int minor, int patch) {
    return std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(patch);
  };
#if EIGEN_MAJOR_VERSION >= 5  // before, the major version was called world
  return join(EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION, EIGEN_PATCH_VERSION);
#else
  return join(EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION);
#endif
}

std::string system_name() {
  const std::string key = "PRETTY_NAME=";
  std::ifstream release("/etc/os-release");
  for (std::string line; std::getline(release, line);) {
    if (line.rfind(key, 0) != 0) continue;
    std::string name = line.substr(key.size());
    if (name.size() >= 2 && (name.front() == '"' || name.front() == '\''))
      name = name.substr(1, name.size() - 2);
    return name;
  }
  return "unknown";
}

}  // namespace sls::app
