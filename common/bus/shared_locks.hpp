#pragma once

namespace sls::bus {

/// From now on this process lives with others that are killed or stopped in the middle of a lock
/// that it shares with them.
///
/// Fast DDS 2.9 passes messages on one machine through shared-memory ports, each with a mutex and a
/// semaphore. At 5,000 steps/s about one in fourteen SIGKILLs hit a process that held such a mutex,
/// and then every write of every other process to that port took a second, until
/// `healthy_check_timeout_ms` was over. So in this process
/// - a mutex that it makes for several processes goes to the next who waits when its holder dies;
/// - whoever waits for one whose holder is stopped gives up after 50 ms (of 1 s): that message is
///   lost, and a reliable stream sends it again (a stopped process is found where both see the same
///   process ids, so not from one container to another);
/// - a reader looks at its port ten times a second, and not only when somebody wakes it: who dies
///   after a message and before the call that wakes the reader leaves a port that wakes nobody;
/// - a reader waits for the locks of its own port as long as it takes: where it gives up after 1 s,
///   the library ends its process.
///
/// It works by standing before three functions of the C library (`shared_locks.cpp`). To be called
/// before the first participant is created; may be called again; never throws.
void guard_shared_locks();

}  // namespace sls::bus
