/// Scheduling priority of processes and threads. Where the system refuses (it takes root,
/// CAP_SYS_NICE or a limit RLIMIT_RTPRIO), everything works, and is late more often.
#pragma once

namespace sls::app {

/// Puts all threads that this process has, and those they start, before those of ordinary
/// processes (SCHED_RR): a control loop in real time must not wait until others have used up their
/// time slice. False if that is refused.
bool put_process_first();

/// Puts the calling thread back among the ordinary ones, behind such as have the usual niceness.
/// Threads that it starts from then on inherit it.
void put_thread_last();

/// The same for all threads that are started from now on, further back: they interrupt nobody when
/// they wake (SCHED_BATCH). For a process that only reads the flight.
void put_viewer_last();

}  // namespace sls::app
