// SPDX-License-Identifier: Apache-2.0
#include "advise/phase_search.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "program/parallel.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::advise {

namespace {

constexpr int kPoints = 16;  // of a grid, in addition to the current phases
constexpr std::array<std::int64_t, 3> kSteps = {16, 128, 1024};  // of the grids, as parts of a timer's range

/// The worst hot path and age of a chain in ms; infinite: there is none.
std::pair<double, double> worst_latencies(const Objective& objective, const GraphBounds& bounds,
                                          std::size_t chain) {
  const std::vector<bool>& from_timers = objective.from_timers;
  if (chain >= from_timers.size() || !from_timers[chain]) return {INFINITY, INFINITY};
  // `bounds` has only the chains that begin in timers.
  const auto row = std::count(from_timers.begin(), from_timers.begin() + std::ptrdiff_t(chain), true);
  const std::optional<ChainAge>& age = bounds.chains[static_cast<std::size_t>(row)];
  return {age && age->hot_path ? to_ms(Duration(*age->hot_path)) : INFINITY,
          age ? to_ms(Duration(age->latency)) : INFINITY};
}

/// The lateness of timers, decided by their response times.
PhaseScore score_of_timers(const TaskSet& set, const GraphBounds& bounds) {
  PhaseScore score{-INFINITY};
  for (TaskId id = 0; id < set.size(); ++id) {
    if (set[id].kind != TaskKind::timer) continue;
    const double response = bounds.tasks[id] ? to_ms(Duration(*bounds.tasks[id])) : INFINITY;
    const double late = response - to_ms(set[id].deadline);
    score.late_timers += late > 0 ? 1 : 0;
    score.value = std::max(score.value, late);
    score.tie += response;
  }
  return score;
}

}  // namespace

PhaseValues exact_values(const Candidate& candidate, const Objective& objective, const FirstTimestamps& first,
                         std::vector<bounds::ReachedWorstCase>* reached) {
  PhaseValues values{.first = first, .refusal = candidate.overload};
  if (candidate.spec.deployment) values.refusal = "a deployment of executors is not explored";
  if (!values.exact()) return values;
  GraphTasks tasks = candidate.tasks;
  setup::set_phases(tasks.set, first);
  const GraphBounds bounds =
      bounds::exact_worst_cases(candidate.graph, tasks, *candidate.spec.entry, candidate.spec.scheduler,
                                {.max_states = bounds::usual_state_limit(tasks.set)}, reached);
  values.refusal = bounds.refusal;
  if (!values.exact()) return values;

  values.score = score_of_timers(tasks.set, bounds);
  auto& [value, late_timers, tie] = values.score;
  std::tie(values.hot_path_ms, values.age_ms) = worst_latencies(objective, bounds, objective.chain);
  if (objective.kind == Objective::Kind::latency) {
    value = objective.of_hot_path() ? values.hot_path_ms : values.age_ms;
    tie = objective.of_hot_path() ? values.age_ms : values.hot_path_ms;
  } else if (objective.kind == Objective::Kind::requirements) {
    value = 0;
    for (const Objective::Requirement& r : objective.requirements)
      value = std::max(value, 100 * worst_latencies(objective, bounds, r.chain).second / r.most_ms);
  }
  if (std::isinf(value)) {
    values.score = {};
    values.refusal = "a timer never runs, or the chain has no output or begins in a subscription";
  }
  values.within_margin = values.score;
  return values;
}

Duration range_of_phases(const TaskSet& set, const std::vector<TaskId>& moved) {
  std::int64_t range = 1, longest = 1;
  for (const TaskId id : moved) {
    const std::int64_t period = set[id].period.count();
    longest = std::max(longest, period);
    for (TaskId other = 0; other < set.size(); ++other) {
      if (set[other].kind != TaskKind::timer || std::ranges::count(moved, other) > 0) continue;
      const std::int64_t common = std::gcd(period, set[other].period.count());
      if (__builtin_mul_overflow(range / std::gcd(range, common), common, &range)) return Duration(longest);
      range = std::min(range, longest);
    }
  }
  return Duration(range);
}

namespace {

using std::chrono::floor, std::chrono::microseconds;

class PhaseSearch {
 public:
  PhaseSearch(const TaskSet& set, const std::vector<TaskId>& together, const EvaluatePhases& evaluate,
              unsigned threads, const std::function<bool()>& stop)
      : set_(set), evaluate_(evaluate), threads_(threads), stop_(stop) {
    for (TaskId id = 0; id < set.size(); ++id) {
      if (set[id].kind != TaskKind::timer) continue;
      if (!timers_.empty()) moves_.push_back({id});  // the first timer stays: only differences matter
      timers_.push_back(id);
    }
    if (together.size() > 1 && together.size() < timers_.size()) moves_.push_back(together);
  }

  FoundPhases from(const std::vector<FirstTimestamps>& starts) {
    PhaseValues best;
    for (const FirstTimestamps& start : starts) {
      std::vector<PhaseValues> values = at({moved(start, timers_, {})}, {});
      if (!complete_) break;
      PhaseValues end = descended(std::move(values.front()), kSteps[0]);
      if (end.within_margin < best.within_margin) best = std::move(end);
    }
    for (std::size_t s = 0; complete_ && s < kSteps.size(); ++s) best = descended(std::move(best), kSteps[s]);
    return {std::move(best), evaluations_, complete_};
  }

 private:
  struct Known {
    PhaseValues values;
    PhaseScore enough;
    [[nodiscard]] bool suffices(const PhaseScore& other) const {
      return values.within_margin <= enough || other <= enough;
    }
  };

  /// Some timers later by a time, below their periods, on whole microseconds.
  FirstTimestamps moved(FirstTimestamps first, const std::vector<TaskId>& later, Duration by) const {
    for (const TaskId id : later) {
      first[id] = floor<microseconds>(first[id] + by) % set_[id].period;
      if (first[id] < Duration{}) first[id] += set_[id].period;
    }
    return first;
  }

  /// The values of phases, of which it evaluates what is not known so far. Empty: the search was stopped.
  std::vector<PhaseValues> at(const std::vector<FirstTimestamps>& points, const PhaseScore& enough) {
    complete_ = complete_ && !stop_();
    if (!complete_) return {};
    std::vector<std::pair<FirstTimestamps, Known>> news;
    for (const FirstTimestamps& point : points) {
      const auto before = known_.find(point);
      if (before == known_.end() || !before->second.suffices(enough)) news.push_back({point, {{}, enough}});
    }
    evaluations_ += news.size();
    program::for_each_index(news.size(), threads_, [&](std::size_t i) {
      news[i].second.values = evaluate_(news[i].first, enough);
      news[i].second.values.first = news[i].first;
    });
    for (auto& [point, value] : news) known_.insert_or_assign(point, std::move(value));
    std::vector<PhaseValues> values;
    values.reserve(points.size());
    for (const FirstTimestamps& point : points) values.push_back(known_.at(point).values);
    return values;
  }

  /// Moves one timer after the other until no timer improves the score.
  PhaseValues descended(PhaseValues best, std::int64_t steps) {
    for (std::size_t i = 0, idle = 0; idle < moves_.size(); ++i, ++idle) {
      const std::vector<TaskId>& move = moves_[i % moves_.size()];
      const auto step = std::max(floor<microseconds>(range_of_phases(set_, move) / steps), microseconds(1));
      std::vector<FirstTimestamps> points;
      for (int k = -kPoints / 2; k <= kPoints / 2; ++k) points.push_back(moved(best.first, move, k * step));
      std::vector<PhaseValues> values = at(points, best.within_margin);
      if (!complete_) break;
      PhaseValues& middle = middle_of_best(values);
      if (middle.within_margin < best.within_margin) idle = 0;
      if (middle.within_margin <= best.within_margin) best = std::move(middle);
    }
    return best;
  }

  /// The middle of the longest run of values with the least score.
  static PhaseValues& middle_of_best(std::vector<PhaseValues>& values) {
    const auto least = std::ranges::min_element(values, {}, &PhaseValues::within_margin)->within_margin;
    std::size_t length = 0, longest = 0, middle = 0;
    for (std::size_t p = 0; p < values.size(); ++p) {
      length = values[p].within_margin == least ? length + 1 : 0;
      if (length > longest) middle = p - length / 2;
      longest = std::max(longest, length);
    }
    return values[middle];
  }

  const TaskSet& set_;
  const EvaluatePhases& evaluate_;
  const unsigned threads_;
  const std::function<bool()>& stop_;
  std::vector<TaskId> timers_;
  std::vector<std::vector<TaskId>> moves_;  // timers that move together
  std::map<FirstTimestamps, Known> known_;
  std::size_t evaluations_ = 0;
  bool complete_ = true;
};

}  // namespace

FoundPhases search_phases(const TaskSet& set, const std::vector<TaskId>& together,
                          const std::vector<FirstTimestamps>& starts, const EvaluatePhases& evaluate,
                          unsigned threads, const std::function<bool()>& stop) {
  return PhaseSearch(set, together, evaluate, threads, stop).from(starts);
}

}  // namespace hotpath::advise
