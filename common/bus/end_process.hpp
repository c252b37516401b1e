#pragma once

#include <cstdio>
#include <cstdlib>
#include <iostream>

namespace sls::bus {

/// Ends this process with exit code `code`, once its nodes are destroyed. Writes out the standard
/// streams and calls what is registered with at_quick_exit, but no destructor of a static object:
/// that of Fast DDS sleeps for 0.1 s (fastdds/README.md, trap 31).
[[noreturn]] inline void end_process(int code) {
  std::cout.flush();
  std::fflush(nullptr);
  std::quick_exit(code);
}

}  // namespace sls::bus
