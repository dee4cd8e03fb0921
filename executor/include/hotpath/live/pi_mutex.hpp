// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pthread.h>

#include <system_error>

namespace hotpath {

/// A mutex with priority inheritance: a preempted executor thread never delays the timer management
/// thread by more than the executor's own critical section. Lockable; the uncontended path makes no
/// system call.
class PiMutex {
 public:
  /// Throws std::system_error.
  PiMutex() {
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    int refused = pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    if (refused == 0) refused = pthread_mutex_init(&mutex_, &attributes);
    pthread_mutexattr_destroy(&attributes);
    if (refused != 0) throw std::system_error(refused, std::generic_category(), "cannot create a mutex");
  }
  ~PiMutex() { pthread_mutex_destroy(&mutex_); }
  PiMutex(const PiMutex&) = delete;
  PiMutex& operator=(const PiMutex&) = delete;

  void lock() { pthread_mutex_lock(&mutex_); }
  void unlock() { pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_;
};

}  // namespace hotpath
