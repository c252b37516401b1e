#include "common/app/stop_signal.hpp"

#include <atomic>
#include <csignal>
#include <initializer_list>

namespace sls::app {
namespace {

// Any thread may run the handler, and others read; sig_atomic_t is for one thread only.
std::atomic<int> received{0};
static_assert(std::atomic<int>::is_always_lock_free, "only then a handler may touch it");

extern "C" void remember_signal(int number) {
  int none = 0;
  received.compare_exchange_strong(none, number);
}

}  // namespace

void install_stop_signals() {
  struct sigaction action {};
  action.sa_handler = remember_signal;
  sigemptyset(&action.sa_mask);
  for (const int number : {SIGINT, SIGTERM}) sigaction(number, &action, nullptr);
  action.sa_handler = SIG_IGN;
  for (const int number : {SIGPIPE, SIGXFSZ}) sigaction(number, &action, nullptr);
}

int stop_signal() { return received; }

}  // namespace sls::app
