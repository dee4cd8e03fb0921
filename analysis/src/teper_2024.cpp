// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/teper_2024.hpp"

#include <algorithm>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

namespace {

using exact::add, exact::subtract;

constexpr std::string_view kMethod = "the default executor's bound (teper_2024)";

/// Lemma VI.2: `all` is the length of a processing window, `higher` the part of it before the timer.
std::int64_t until_timer_starts(std::int64_t period, std::int64_t cost, std::int64_t all,
                                std::int64_t higher) {
  return add(all, std::max<std::int64_t>(0, add(subtract(period, cost), higher)));
}

}  // namespace

std::vector<std::int64_t> teper_2024_timers(const PeriodicTasks& tasks) {
  check_tasks(tasks, {.method = kMethod, .instead = "", .jitter = false});
  std::int64_t all = 0, higher = 0;
  for (const PeriodicTask& t : tasks) all = add(all, t.wcet);
  std::vector<std::int64_t> bounds;
  bounds.reserve(tasks.size());
  for (const PeriodicTask& t : tasks) {
    bounds.push_back(add(until_timer_starts(t.period, t.wcet, all, higher), t.wcet));
    higher += t.wcet;  // at most `all`
  }
  return bounds;
}

}  // namespace hotpath
