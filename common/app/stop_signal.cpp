#include "common/app/stop_signal.hpp"

#include <csignal>
#include <initializer_list>

namespace sls::app {
namespace {

volatile std::sig_atomic_t received = 0;

extern "C" void remember_signal(int number) {
  if (received == 0) received = number;
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
