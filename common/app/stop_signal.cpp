#include "common/app/stop_signal.hpp"

#include <errno.h>  // program_invocation_short_name
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstring>

namespace sls::app {
namespace {

// Any thread may run the handlers while others read; sig_atomic_t is safe in one thread only.
std::atomic<int> received{0};
std::atomic<unsigned> patience_s{0};
std::atomic<int> unhurried{0};
static_assert(std::atomic<int>::is_always_lock_free, "only then a handler may touch it");

extern "C" void remember_signal(int number) {
  int none = 0;
  if (received.compare_exchange_strong(none, number) && unhurried == 0) ::alarm(patience_s);
}

/// A signal handler may call only a few functions, and none that allocates or locks.
extern "C" void give_up(int) {
  for (const char* text :
       {const_cast<const char*>(program_invocation_short_name),
        ": error: did not end after the stop signal: exits now, its files may be "
        "incomplete\n"})
    if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) break;
  ::_exit(128 + received);
}

}  // namespace

void install_stop_signals(std::chrono::seconds patience) {
  patience_s = static_cast<unsigned>(patience.count());
  struct sigaction action {};
  sigemptyset(&action.sa_mask);
  action.sa_handler = remember_signal;
  struct sigaction at_start {};
  sigaction(SIGHUP, nullptr, &at_start);
  const bool is_detached = at_start.sa_handler == SIG_IGN;  // nohup
  for (const int number : {SIGINT, SIGTERM, SIGHUP})
    if (number != SIGHUP || !is_detached) sigaction(number, &action, nullptr);
  action.sa_handler = give_up;
  sigaction(SIGALRM, &action, nullptr);
  action.sa_handler = SIG_IGN;
  for (const int number : {SIGPIPE, SIGXFSZ}) sigaction(number, &action, nullptr);
  // A program inherits the mask of the one that started it, which may have blocked these signals.
  sigset_t heard;
  sigemptyset(&heard);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGALRM}) sigaddset(&heard, number);
  pthread_sigmask(SIG_UNBLOCK, &heard, nullptr);
}

int stop_signal() { return received; }

std::string describe_stop() {
  const int signal = received;
  if (signal == 0) return "";
  return signal == SIGINT    ? "interrupted by SIGINT"
         : signal == SIGTERM ? "interrupted by SIGTERM"
                             : "interrupted by SIGHUP: its terminal or connection has closed";
}

Unhurried::Unhurried() {
  ++unhurried;
  ::alarm(0);
}

Unhurried::~Unhurried() {
  if (--unhurried == 0 && received != 0) ::alarm(patience_s);
}

}  // namespace sls::app
