// SPDX-License-Identifier: Apache-2.0
// A library for LD_PRELOAD that steps the real-time clock of a program by HOTPATH_CLOCK_STEP
// seconds, HOTPATH_CLOCK_STEP_AFTER seconds after its start. It converts deadlines on this clock to
// the kernel's clock, so that timed waits behave as after a real step.
#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>

namespace {

time_t number(const char* variable) {
  const char* const given = getenv(variable);
  return given == nullptr ? 0 : strtol(given, nullptr, 10);
}

timespec kernel_clock(clockid_t clock) {
  timespec now{};
  syscall(SYS_clock_gettime, clock, &now);
  return now;
}

/// Current difference from the kernel's clock, in seconds.
time_t step() {
  static const time_t began = kernel_clock(CLOCK_MONOTONIC).tv_sec, by = number("HOTPATH_CLOCK_STEP"),
                      after = number("HOTPATH_CLOCK_STEP_AFTER");
  return kernel_clock(CLOCK_MONOTONIC).tv_sec >= began + after ? by : 0;
}

timespec in_kernel_time(const timespec* stepped) { return {stepped->tv_sec - step(), stepped->tv_nsec}; }

__attribute__((constructor)) void begin() { step(); }

template <class Function>
Function* real(Function*, const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

int clock_gettime(clockid_t clock, timespec* now) noexcept {
  const auto result = static_cast<int>(syscall(SYS_clock_gettime, clock, now));
  if (result == 0 && clock == CLOCK_REALTIME) now->tv_sec += step();
  return result;
}

int gettimeofday(timeval* now, void*) noexcept {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  *now = {t.tv_sec, t.tv_nsec / 1000};
  return 0;
}

time_t time(time_t* now) noexcept {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  return now == nullptr ? t.tv_sec : *now = t.tv_sec;
}

int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* until) {
  static const auto wait = real(pthread_cond_timedwait, "pthread_cond_timedwait");
  const timespec kernel = in_kernel_time(until);
  return wait(condition, mutex, &kernel);
}

int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const timespec* until) {
  static const auto wait = real(pthread_cond_clockwait, "pthread_cond_clockwait");
  const timespec kernel = clock == CLOCK_REALTIME ? in_kernel_time(until) : *until;
  return wait(condition, mutex, clock, &kernel);
}

int pthread_mutex_timedlock(pthread_mutex_t* mutex, const timespec* until) noexcept {
  static const auto wait = real(pthread_mutex_timedlock, "pthread_mutex_timedlock");
  const timespec kernel = in_kernel_time(until);
  return wait(mutex, &kernel);
}

int sem_timedwait(sem_t* semaphore, const timespec* until) {
  static const auto wait = real(sem_timedwait, "sem_timedwait");
  const timespec kernel = in_kernel_time(until);
  return wait(semaphore, &kernel);
}

}  // extern "C"
