/// Scheduling priority of processes and threads. Real-time priority requires root, CAP_SYS_NICE or
/// a limit RLIMIT_RTPRIO. If the system refuses it, the programs work, but are late more often.
#pragma once

namespace sls::app {

/// Gives all threads of this process, and the threads that they start, real-time priority
/// (SCHED_RR). A control loop in real time must not wait until ordinary processes have used up
/// their time slices. False if the system refuses.
bool put_process_first();

/// Gives the calling thread ordinary priority (SCHED_OTHER), below that of threads with the usual
/// niceness. Threads that it starts from then on inherit it.
void put_thread_last();

/// The same with a still lower priority and SCHED_BATCH: a thread that wakes does not interrupt
/// another one. For a process that only reads the flight. Call this before it starts threads.
void put_viewer_last();

}  // namespace sls::app
