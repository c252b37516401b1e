/// Any file is a QoS file, which is completed, or causes a ConfigError.
#include <netdb.h>

#include <cstdint>
#include <string>

#include "common/bus/qos_file.hpp"
#include "common/config/config_error.hpp"
#include "tests/fuzz/memory_file.hpp"

/// Replaces the system's function (see CMakeLists.txt): host names of an input must not be looked
/// up.
extern "C" int __wrap_getaddrinfo(const char*, const char*, const addrinfo*, addrinfo**) {
  return EAI_NONAME;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sls;
  std::string completed;
  try {
    completed = bus::read_qos_file(fuzz::MemoryFile(data, size).path(), "server");
  } catch (const config::ConfigError&) {
    return 0;
  }
  return completed.empty() ? -1 : 0;
}
