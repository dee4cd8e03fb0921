// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/core/events_scheduler.hpp"

namespace hotpath {

/// Release-only (RO): the timer management worker turns due timers into events; the executor workers run all
/// jobs.
class ReleaseOnlyScheduler final : public EventsScheduler {
 public:
  /// one_by_one: one timer and one wake-up per call (stock, timers_manager.cpp); all_due: all due
  /// timers under one lock with one wake-up (the paper's).
  enum class Release : std::uint8_t { one_by_one, all_due };
  ReleaseOnlyScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events, Release release,
                       unsigned executors = 1)
      : EventsScheduler(set, std::move(events), executors), release_(release) {}

  Effect release_timers(Worker worker, Time now) override;
  Decision decide(Worker worker, Time now) override;
  [[nodiscard]] std::unique_ptr<ExploredScheduler> clone() const override {
    return timer_management() == 1 ? std::make_unique<ReleaseOnlyScheduler>(*this) : nullptr;
  }

 private:
  const Release release_;
};

}  // namespace hotpath
