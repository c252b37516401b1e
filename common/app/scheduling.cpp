#include "common/app/scheduling.hpp"

#include <sched.h>
#include <sys/resource.h>

#include <filesystem>
#include <system_error>

namespace sls::app {
namespace {

constexpr int kPriority = 1;  // the lowest real-time priority
constexpr int kNiceness = 5;
constexpr int kViewerNiceness = 10;  // above it a page freezes on a busy machine

void put_back(int policy, int niceness) {
  const sched_param parameters{};
  sched_setscheduler(0, policy, &parameters);
  setpriority(PRIO_PROCESS, 0, niceness);  // of the calling thread alone
}

}  // namespace

bool put_process_first() {
  bool is_granted = true;
  std::error_code error;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task", error)) {
    sched_param parameters{};
    parameters.sched_priority = kPriority;
    const int id = std::atoi(thread.path().filename().c_str());
    is_granted = sched_setscheduler(id, SCHED_RR, &parameters) == 0 && is_granted;
  }
  return is_granted && !error;
}

void put_thread_last() { put_back(SCHED_OTHER, kNiceness); }

void put_viewer_last() { put_back(SCHED_BATCH, kViewerNiceness); }

}  // namespace sls::app
