// SPDX-License-Identifier: Apache-2.0
#include "import/fitted_levels.hpp"

#include <algorithm>
#include <set>

namespace hotpath::imports {

namespace {

/// Most comparisons of levels, and decisions of each: a bound on the time.
constexpr std::size_t kComparisons = 100, kDecisions = 2000;
/// Pairs of timers that each round tries to reorder.
constexpr std::size_t kPairs = 4;

using Levels = std::vector<std::int64_t>;

class Fit {
 public:
  Fit(const TaskSet& set, const RecordedSteps& steps, Hypothesis& hypothesis, std::size_t starts)
      : set_(set), steps_(steps), hypothesis_(hypothesis), starts_(std::min(starts, kDecisions)) {}

  void run() {
    Levels by_period(set_.size(), 0);
    for (TaskId id = 0; id < set_.size(); ++id) by_period[id] = set_[id].period.count();
    best_levels_ = by_period;
    best_ = attempt(by_period);
    keep_better(Levels(set_.size(), 1));
    while (improve()) {
    }
    hypothesis_.levels = ranks(best_levels_);
  }

 private:
  Agreement attempt(const Levels& levels) {
    ++comparisons_;
    hypothesis_.levels = ranks(levels);
    return follow(set_, steps_, hypothesis_, 0, starts_);
  }

  bool keep_better(const Levels& levels) {
    if (comparisons_ >= kComparisons) return false;
    Agreement agreement = attempt(levels);
    if (agreement.contradictions >= best_.contradictions) return false;
    best_ = std::move(agreement);
    best_levels_ = levels;
    return true;
  }

  /// Levels of timers as 2, 4, 6, ..., so that each has a free level before and after it.
  Levels ranks(const Levels& levels) const {
    std::set<std::int64_t> distinct;
    for (TaskId id = 0; id < set_.size(); ++id)
      if (set_[id].kind == TaskKind::timer) distinct.insert(levels[id]);
    Levels ranks(levels.size(), 0);
    for (TaskId id = 0; id < set_.size(); ++id)
      if (set_[id].kind == TaskKind::timer)
        ranks[id] = 2 * (1 + std::distance(distinct.begin(), distinct.find(levels[id])));
    return ranks;
  }

  /// Tries to reorder the timers whose jobs, or whose readers' jobs, contradict the levels most.
  bool improve() {
    hypothesis_.levels = ranks(best_levels_);
    TaskSet leveled = set_;
    for (TaskId id = 0; id < set_.size(); ++id) {
      if (set_[id].kind == TaskKind::timer)
        leveled.tasks[id].priority = hypothesis_.levels[id];
      else
        leveled.tasks[id].priority.reset();
    }
    const std::vector<TaskId> origin = most_urgent_timers(leveled, Policy::fp);
    std::map<std::pair<TaskId, TaskId>, std::uint32_t> wrong;
    for (const auto& [pair, count] : best_.before) {
      const TaskId ran = origin[pair.first], ahead = origin[pair.second];
      if (ran != ahead && ran != kNoTask && ahead != kNoTask) wrong[{ran, ahead}] += count;
    }
    std::vector<std::pair<std::uint32_t, std::pair<TaskId, TaskId>>> most;
    most.reserve(wrong.size());
    for (const auto& [pair, count] : wrong) most.emplace_back(count, pair);
    std::ranges::stable_sort(most, std::ranges::greater{}, [](const auto& m) { return m.first; });
    if (most.size() > kPairs) most.resize(kPairs);
    for (const auto& [count, pair] : most) {
      const Levels from = ranks(best_levels_);
      const auto [ran, ahead] = pair;
      for (const auto& [timer, level] : {std::pair(ran, from[ahead] - 1), std::pair(ran, from[ahead]),
                                         std::pair(ahead, from[ran] + 1), std::pair(ahead, from[ran])}) {
        Levels to = from;
        to[timer] = level;
        if (keep_better(to)) return true;
      }
    }
    return false;
  }

  const TaskSet& set_;
  const RecordedSteps& steps_;
  Hypothesis& hypothesis_;
  const std::size_t starts_;
  std::size_t comparisons_ = 0;
  Levels best_levels_;
  Agreement best_;
};

}  // namespace

void fit_levels(const TaskSet& set, const RecordedSteps& steps, Hypothesis& hypothesis, std::size_t starts) {
  Fit(set, steps, hypothesis, starts).run();
}

}  // namespace hotpath::imports
