// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>

#include "import/hypothesis.hpp"

namespace hotpath::imports {

namespace {

/// Most comparisons of levels, and decisions of each: a bound on the time.
constexpr std::size_t kComparisons = 100, kDecisions = 2000;
/// Pairs of timers that each round tries to reorder.
constexpr std::size_t kPairs = 4;

using Levels = std::vector<std::int64_t>;
using Pair = std::pair<TaskId, TaskId>;

/// Levels of timers as 2, 4, 6, ..., so that each has a free level before and after it.
Levels ranks(const TaskSet& set, const Levels& levels) {
  std::set<std::int64_t> distinct;
  for (TaskId id = 0; id < set.size(); ++id)
    if (set[id].kind == TaskKind::timer) distinct.insert(levels[id]);
  Levels ranks(levels.size(), 0);
  for (TaskId id = 0; id < set.size(); ++id)
    if (set[id].kind == TaskKind::timer)
      ranks[id] = 2 * (1 + std::distance(distinct.begin(), distinct.find(levels[id])));
  return ranks;
}

/// The pairs of timers whose jobs, or whose readers' jobs, contradict the levels most: the one that ran, and
/// the one ahead of it.
std::vector<Pair> most_wrong(TaskSet set, const Levels& levels, const Agreement& agreement) {
  for (TaskId id = 0; id < set.size(); ++id) {
    set.tasks[id].priority.reset();
    if (set[id].kind == TaskKind::timer) set.tasks[id].priority = levels[id];
  }
  const std::vector<TaskId> origin = most_urgent_timers(set, Policy::fp);
  std::map<Pair, std::uint32_t> wrong;
  for (const auto& [pair, count] : agreement.before) {
    const TaskId ran = origin[pair.first], ahead = origin[pair.second];
    if (ran != ahead && ran != kNoTask && ahead != kNoTask) wrong[{ran, ahead}] += count;
  }
  std::vector<Pair> most;
  most.reserve(wrong.size());
  for (const auto& [pair, count] : wrong) most.push_back(pair);
  std::ranges::stable_sort(most, std::ranges::greater{}, [&](const Pair& pair) { return wrong.at(pair); });
  most.resize(std::min(most.size(), kPairs));
  return most;
}

}  // namespace

void fit_levels(const TaskSet& set, const RecordedSteps& steps, Hypothesis& hypothesis, std::size_t starts) {
  std::size_t comparisons = 0;
  Levels best;
  Agreement of_best;
  const auto keep_better = [&](const Levels& levels) {
    if (comparisons == kComparisons) return false;
    hypothesis.levels = ranks(set, levels);
    Agreement agreement = follow(set, steps, hypothesis, 0, std::min(starts, kDecisions));
    if (comparisons++ > 0 && agreement.contradictions >= of_best.contradictions) return false;
    of_best = std::move(agreement);
    best = hypothesis.levels;
    return true;
  };
  Levels by_period;
  for (const Task& task : set.tasks) by_period.push_back(task.period.count());
  keep_better(by_period);
  keep_better(Levels(set.size(), 1));
  const auto improve = [&] {
    const Levels& from = best;  // unchanged until a better one is found, which ends this
    for (const auto& [ran, ahead] : most_wrong(set, from, of_best)) {
      for (const auto& [timer, level] : {std::pair(ran, from[ahead] - 1), std::pair(ran, from[ahead]),
                                         std::pair(ahead, from[ran] + 1), std::pair(ahead, from[ran])}) {
        Levels to = from;
        to[timer] = level;
        if (keep_better(to)) return true;
      }
    }
    return false;
  };
  while (improve()) {
  }
  hypothesis.levels = best;
}

}  // namespace hotpath::imports
