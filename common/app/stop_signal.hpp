#pragma once

#include <chrono>

namespace sls::app {

/// From now on SIGINT and SIGTERM only set a flag; loops end their step and close their files.
/// A program still running `patience` after the first signal exits with an error line on stderr and
/// exit code 130 or 143: a packet can leave the middleware with a lock held for good
/// (tests/hostile/README.md), and a program that cannot be stopped hides that.
/// SIGPIPE and SIGXFSZ are ignored: the failing write reports them. SIGALRM is taken.
void install_stop_signals(std::chrono::seconds patience = std::chrono::seconds(20));

/// 0, or the number of the first stop signal received.
int stop_signal();

/// While one lives, that patience does not run: for work of its own that may take long. It begins
/// anew after it.
class Unhurried {
 public:
  Unhurried();
  ~Unhurried();
  Unhurried(const Unhurried&) = delete;
  Unhurried& operator=(const Unhurried&) = delete;
};

}  // namespace sls::app
