// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/core/events_scheduler.hpp"

namespace hotpath {

/// The paper's release-and-execute (Section IV): due timers move into a prioritised timer ready
/// queue, which is refilled before every decision; its head runs. The executor worker runs
/// subscriptions.
class TimerReadyQueueScheduler final : public EventsScheduler {
 public:
  TimerReadyQueueScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events,
                           std::unique_ptr<EventsQueue> timer_ready)
      : EventsScheduler(set, std::move(events)), timer_ready_(std::move(timer_ready)) {}

  Effect release_timers(Worker worker, Time now) override;
  Decision decide(Worker worker, Time now) override;
  void unfinished(Time now, const Visitor& visit) const override;

 private:
  void for_each_queue(const std::function<void(EventsQueue&)>& visit) override {
    EventsScheduler::for_each_queue(visit);
    visit(*timer_ready_);
  }

  std::unique_ptr<EventsQueue> timer_ready_;
};

}  // namespace hotpath
