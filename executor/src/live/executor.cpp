// SPDX-License-Identifier: Apache-2.0
#include "hotpath/live/executor.hpp"

#include <pthread.h>

#include "executor_threads.hpp"

namespace hotpath {

ThreadPolicy SystemSync::prepare_thread(WorkerRole role, const ThreadPolicyRequest& request) {
  pthread_setname_np(pthread_self(), to_string(role));
  minimise_timer_slack();
  return apply_thread_policy(request);
}

ExecutorOptions default_options(const ExecutorEntry& entry) {
  ExecutorOptions options;
  if (entry.traits.raises_timer_thread) options.timer_thread.policy = raised_above({});
  return options;
}

template class BasicExecutor<SystemSync>;

}  // namespace hotpath
