// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
#include <vector>

#include "hotpath/analysis/statistics.hpp"
#include "hotpath/core/events_scheduler.hpp"
#include "hotpath/core/paper_timers.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/live/clock.hpp"
#include "hotpath/live/pi_mutex.hpp"

namespace hotpath::machine {

/// The cost of releasing one timer on this machine (the paper's delta), without waking a thread.
struct ReleaseCost {
  Duration p999{}, max{};
  /// Length of one pass of the releaser that releases `timers` at once: the paper's
  /// k + timers * delta.
  struct Pass {
    std::uint32_t timers = 0;
    std::size_t passes = 0;
    Duration p50{}, p99{}, max{};
  };
  std::vector<Pass> passes = {};  ///< Ascending in `timers`.
};

/// Measures the release cost on the calling thread with the paper's seven timers under `rm-ro`;
/// divides the cost of simultaneous releases by their number. Takes tens of milliseconds.
inline ReleaseCost measure_release_cost() {
  constexpr int kPasses = 50'000;
  const TaskSet set = paper_timers(90);
  const auto scheduler = find_executor("rm-ro")->make(set, {});
  scheduler->begin(Time{});
  PiMutex mutex;
  std::vector<Duration> cost;
  cost.reserve(kPasses);
  std::map<std::uint32_t, std::vector<Duration>> passes;
  Time virtual_now{};
  for (int pass = 0; pass < kPasses; ++pass) {
    const Time before = now();
    mutex.lock();
    const Effect effect = scheduler->release_timers(EventsScheduler::kTimerManagement, virtual_now);
    mutex.unlock();
    const Duration spent = now() - before;
    if (effect.released > 0) {
      cost.push_back(spent / effect.released);
      passes[effect.released].push_back(spent);
    }
    virtual_now = scheduler->decide(EventsScheduler::kTimerManagement, virtual_now).wake_at;
    while (scheduler->decide(EventsScheduler::kExecutor, virtual_now).job) {
    }
  }
  std::ranges::sort(cost);
  ReleaseCost result{cost[nearest_rank(cost.size(), 0.999)], cost.back()};
  for (auto& [timers, spent] : passes) {
    std::ranges::sort(spent);
    const auto at = [&spent = spent](double share) { return spent[nearest_rank(spent.size(), share)]; };
    result.passes.push_back({timers, spent.size(), at(0.5), at(0.99), spent.back()});
  }
  return result;
}

}  // namespace hotpath::machine
