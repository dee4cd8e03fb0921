// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/core/events_scheduler.hpp"

namespace hotpath {

/// Stock release-and-execute (RE): the timer management worker calls and runs the timer with the earliest
/// next call (timers_manager.cpp); the executor worker runs subscriptions.
class ReleaseAndExecuteScheduler final : public EventsScheduler {
 public:
  ReleaseAndExecuteScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events)
      : EventsScheduler(set, std::move(events)) {}

  Effect release_timers(Worker, Time) override { return {}; }
  Decision decide(Worker worker, Time now) override;
};

}  // namespace hotpath
