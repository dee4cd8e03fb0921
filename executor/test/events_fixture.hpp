// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include "hotpath/core/events_scheduler.hpp"
#include "hotpath/core/registry.hpp"
#include "task_sets.hpp"

namespace hotpath::test {

inline constexpr Worker kExecutor = EventsScheduler::kExecutor;
inline constexpr Worker kReleaser = EventsScheduler::kTimerManagement;

/// An events executor for `set` whose workers take turns one at a time.
class EventsFixture : public testing::Test {
 protected:
  void start(const char* executor) {
    scheduler = find_executor(executor)->make(set, {});
    scheduler->begin(Time{});
  }
  std::optional<Job> next(Worker worker, Duration now) {
    return take_turn(*scheduler, worker, at(now)).decision.job;
  }
  TaskSet set;
  std::unique_ptr<Scheduler> scheduler;
};

}  // namespace hotpath::test
