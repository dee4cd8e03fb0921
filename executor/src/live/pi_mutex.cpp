// SPDX-License-Identifier: Apache-2.0
#include "hotpath/live/pi_mutex.hpp"

#include <system_error>

namespace hotpath {

PiMutex::PiMutex() {
  pthread_mutexattr_t attributes;
  pthread_mutexattr_init(&attributes);
  int refused = pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
  if (refused == 0) refused = pthread_mutex_init(&mutex_, &attributes);
  pthread_mutexattr_destroy(&attributes);
  if (refused != 0) throw std::system_error(refused, std::generic_category(), "cannot create a mutex");
}

}  // namespace hotpath
