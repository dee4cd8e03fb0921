// SPDX-License-Identifier: Apache-2.0
#include "hotpath/live/pi_mutex.hpp"

#include <cassert>

namespace hotpath {

PiMutex::PiMutex() {
  pthread_mutexattr_t attributes;
  pthread_mutexattr_init(&attributes);
  [[maybe_unused]] const int refused = pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
  assert(refused == 0);
  pthread_mutex_init(&mutex_, &attributes);
  pthread_mutexattr_destroy(&attributes);
}

}  // namespace hotpath
