// To be preloaded: the clocks of a process pass a fiftieth of the real time, and its waits with a
// time limit last fifty times as long. Under callgrind a program is that much slower. With
// clocks as slow as itself it does as many steps between two looks of a timer as without callgrind,
// also beside other work. So its instructions per step do not depend on the machine's speed.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/time.h>
#include <time.h>

enum { kSlower = 50, kSecond_ns = 1000000000 };

// The function of the C library that ours replaces.
#define NEXT(name)               \
  static __typeof__(&name) next; \
  if (!next) next = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

// From here on a clock is slow: all processes begin at the same time.
static time_t find_begin(clockid_t clock) { return clock == CLOCK_REALTIME ? 1600000000 : 0; }

static struct timespec to_slow(clockid_t clock, struct timespec real) {
  const time_t begin = find_begin(clock), passed = real.tv_sec - begin;
  const long rest_ns = (passed % kSlower) * kSecond_ns + real.tv_nsec;
  return (struct timespec){begin + passed / kSlower, rest_ns / kSlower};
}

static struct timespec stretch(struct timespec time) {
  const long rest_ns = time.tv_nsec * kSlower;
  return (struct timespec){time.tv_sec * kSlower + rest_ns / kSecond_ns, rest_ns % kSecond_ns};
}

// A deadline of a slow clock on the real one. Times before its begin and in the far future stay.
static struct timespec to_real(clockid_t clock, const struct timespec* slow) {
  const time_t begin = find_begin(clock), longest = 1000000000;
  struct timespec passed = *slow;
  passed.tv_sec -= begin;
  if (passed.tv_sec < 0 || passed.tv_sec > longest) return *slow;
  passed = stretch(passed);
  passed.tv_sec += begin;
  return passed;
}

int clock_gettime(clockid_t clock, struct timespec* time) {
  NEXT(clock_gettime);
  const int result = next(clock, time);
  if (clock == CLOCK_REALTIME || clock == CLOCK_MONOTONIC) *time = to_slow(clock, *time);
  return result;
}

int gettimeofday(struct timeval* restrict time, void* restrict zone) {
  (void)zone;
  struct timespec now;
  const int result = clock_gettime(CLOCK_REALTIME, &now);
  *time = (struct timeval){now.tv_sec, now.tv_nsec / 1000};
  return result;
}

int nanosleep(const struct timespec* time, struct timespec* rest) {
  NEXT(nanosleep);
  const struct timespec longer = stretch(*time);
  return next(&longer, rest);
}

int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const struct timespec* deadline) {
  NEXT(pthread_cond_clockwait);
  const struct timespec real = to_real(clock, deadline);
  return next(condition, mutex, clock, &real);
}

int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex,
                           const struct timespec* deadline) {
  NEXT(pthread_cond_timedwait);
  const struct timespec real = to_real(CLOCK_REALTIME, deadline);
  return next(condition, mutex, &real);
}

int pthread_mutex_clocklock(pthread_mutex_t* mutex, clockid_t clock,
                            const struct timespec* deadline) {
  NEXT(pthread_mutex_clocklock);
  const struct timespec real = to_real(clock, deadline);
  return next(mutex, clock, &real);
}

int pthread_mutex_timedlock(pthread_mutex_t* mutex, const struct timespec* deadline) {
  NEXT(pthread_mutex_timedlock);
  const struct timespec real = to_real(CLOCK_REALTIME, deadline);
  return next(mutex, &real);
}

int sem_timedwait(sem_t* semaphore, const struct timespec* deadline) {
  NEXT(sem_timedwait);
  const struct timespec real = to_real(CLOCK_REALTIME, deadline);
  return next(semaphore, &real);
}
