#include "common/bus/spinning.hpp"

#include <sched.h>

#include <cstdlib>
#include <string_view>

namespace sls::bus {
namespace {

bool has_two_processors() {
  cpu_set_t allowed;
  return sched_getaffinity(0, sizeof(allowed), &allowed) == 0 && CPU_COUNT(&allowed) > 1;
}

bool is_switched_off() {
  const char* value = std::getenv("SLS_SPIN");
  return value && std::string_view(value) == "off";
}

}  // namespace

void start_spinning() { is_spinning = has_two_processors() && !is_switched_off(); }

void stop_spinning() { is_spinning = false; }

}  // namespace sls::bus
