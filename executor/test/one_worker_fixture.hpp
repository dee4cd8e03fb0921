// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "task_sets.hpp"

namespace hotpath::test {

/// A wait-set scheduler for `set` with one worker: a picked job finishes before the next call.
template <class TheScheduler>
class OneWorkerFixture : public testing::Test {
 protected:
  template <class... Arguments>
  TheScheduler& start(Arguments... arguments) {
    scheduler = std::make_unique<TheScheduler>(set, arguments...);
    scheduler->begin(Time{});
    return *scheduler;
  }

  /// The task that runs next at `now`, or kNoTask; its job takes no time.
  TaskId next(Duration now) {
    job = scheduler->decide(0, at(now)).job;
    if (!job) return kNoTask;
    scheduler->finished(0, *job, at(now));
    return job->task;
  }

  TaskSet set;
  std::unique_ptr<TheScheduler> scheduler;
  std::optional<Job> job;
};

}  // namespace hotpath::test
