/// Replaces `gmtime_r` of the C library in the programs that link this file (sim_server,
/// control_client, recorder). Fast DDS makes a calendar date for each wait for a lock or a message
/// of shared memory (boost::interprocess), ten times in a step. Here a thread makes one a second.
///
/// Upstream: none reported. To be deleted when these waits need no calendar.
#include <dlfcn.h>

#include <ctime>
#include <optional>

tm* gmtime_r(const time_t* time, tm* date) noexcept {
  static const auto next = reinterpret_cast<decltype(&gmtime_r)>(dlsym(RTLD_NEXT, "gmtime_r"));
  thread_local std::optional<time_t> latest;
  thread_local tm latest_date;
  if (*time != latest) {
    if (!next(time, date)) return nullptr;  // the number of its year is too large
    latest = *time;
    latest_date = *date;
  }
  *date = latest_date;
  return date;
}
