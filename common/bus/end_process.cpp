#include "common/bus/end_process.hpp"

#include <cstdio>
#include <cstdlib>
#include <iostream>

namespace sls::bus {

void end_process(int code) {
  std::cout.flush();
  std::fflush(nullptr);
  std::quick_exit(code);
}

}  // namespace sls::bus
