#pragma once

#include <chrono>
#include <string>

namespace sls::app {

/// From now on SIGINT, SIGTERM and SIGHUP only set a flag; loops end their step and close their
/// files. SIGHUP stays ignored if it was at the start (nohup); a mask that blocks them is lifted.
/// A program still running `patience` after the first signal exits with an error line on stderr and
/// exit code 130, 143 or 129. A hostile packet can keep a lock of the middleware locked for ever
/// (tests/hostile/README.md), and a program that never ends would hide this.
/// SIGPIPE and SIGXFSZ are ignored: the failing write reports them. SIGALRM is used for `patience`.
void install_stop_signals(std::chrono::seconds patience = std::chrono::seconds(20));

/// 0, or the number of the first stop signal received.
int stop_signal();

/// "interrupted by SIGINT", or by another; empty before the first stop signal.
std::string describe_stop();

/// Suspends the time `patience` of install_stop_signals while an object exists: for work of the
/// program that may take long. The time then starts again from the beginning.
class Unhurried {
 public:
  Unhurried();
  ~Unhurried();
  Unhurried(const Unhurried&) = delete;
  Unhurried& operator=(const Unhurried&) = delete;
};

}  // namespace sls::app
