/// A foreign program: it writes sls/state with a type of another name, until SIGTERM.
#include <pthread.h>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "common/bus/node.hpp"

int main(int argc, char** argv) {
  using namespace sls::bus;
  if (argc != 3) return 2;
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);  // before Fast DDS's threads, which inherit it
  Node node(argv[1], std::atoi(argv[2]), "stranger");
  const detail::AnyWriter writer(node, Topic<sls::States>::kName, kLatchedWriterProfile,
                                 detail::make_type_support<sls::SimStatus>());
  std::puts("there");
  std::fflush(stdout);
  int signal = 0;
  sigwait(&ends, &signal);
}
