/// LD_PRELOAD library that shifts the result of time(), with which certificates are compared, by
/// SLS_CLOCK_SHIFT_S seconds. The other clocks of the process do not change.
#include <sys/time.h>

#include <cstdlib>
#include <ctime>

extern "C" std::time_t time(std::time_t* result) noexcept {
  timeval now = {};
  gettimeofday(&now, nullptr);
  const char* shift = std::getenv("SLS_CLOCK_SHIFT_S");
  const std::time_t shifted = now.tv_sec + (shift ? std::atol(shift) : 0);
  if (result) *result = shifted;
  return shifted;
}
