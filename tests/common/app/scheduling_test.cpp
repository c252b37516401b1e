#include "common/app/scheduling.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>

#include <thread>

namespace sls::app {
namespace {

TEST(SchedulingTest, AProcessIsPutFirstWithItsNewThreadsAndAThreadCanStepBack) {
  if (!put_process_first()) GTEST_SKIP() << "needs root, CAP_SYS_NICE or RLIMIT_RTPRIO";
  EXPECT_EQ(sched_getscheduler(0), SCHED_RR);
  int at_first = -1, afterwards = -1, niceness = -1;
  std::thread([&] {
    at_first = sched_getscheduler(0);
    put_thread_last();
    afterwards = sched_getscheduler(0);
    niceness = getpriority(PRIO_PROCESS, 0);
  }).join();
  EXPECT_EQ(at_first, SCHED_RR);
  EXPECT_EQ(afterwards, SCHED_OTHER);
  EXPECT_GT(niceness, 0);
  EXPECT_EQ(sched_getscheduler(0), SCHED_RR) << "the others stay";
  const sched_param ordinary{};
  EXPECT_EQ(sched_setscheduler(0, SCHED_OTHER, &ordinary), 0);
}

}  // namespace
}  // namespace sls::app
