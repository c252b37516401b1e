/// LD_PRELOAD library: while the file SLS_NO_THREADS exists, the main thread cannot start a thread
/// (EAGAIN), as on a system without free threads.
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <unistd.h>

#include <cstdlib>

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes,
                              void* (*work)(void*), void* argument) {
  static const auto original =
      reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
  static const char* const file = std::getenv("SLS_NO_THREADS");
  if (file && gettid() == getpid() && access(file, F_OK) == 0) return EAGAIN;
  return original(thread, attributes, work, argument);
}
