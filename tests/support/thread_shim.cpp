/// LD_PRELOAD library that lets a process's main thread start no further thread as long as the file
/// SLS_NO_THREADS exists: as on a system that has no more of them.
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
