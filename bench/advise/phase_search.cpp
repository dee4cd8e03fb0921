// SPDX-License-Identifier: Apache-2.0
#include "advise/phase_search.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <numeric>

#include "program/parallel.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::advise {

namespace {

constexpr int kPoints = 16;  // of a grid, in addition to the current phases
constexpr std::array<std::int64_t, 3> kSteps = {16, 128, 1024};  // of the grids, as parts of a timer's range

/// The worst hot path and age in ms, by chain of the graph; infinite: there is none. `bounds` has only the
/// chains that begin in timers.
std::vector<std::pair<double, double>> worst_latencies(const Objective& objective,
                                                       const GraphBounds& bounds) {
  std::vector<std::pair<double, double>> worst;
  auto row = bounds.chains.begin();
  for (const bool from_timers : objective.from_timers) {
    const std::optional<ChainAge> age = from_timers ? *row++ : std::nullopt;
    worst.emplace_back(age && age->hot_path ? to_ms(Duration(*age->hot_path)) : INFINITY,
                       age ? to_ms(Duration(age->latency)) : INFINITY);
  }
  return worst;
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

  auto& [value, late_timers, tie] = values.score;
  value = -INFINITY;  // the lateness of timers, decided by their response times, unless a chain is judged
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (tasks.set[id].kind != TaskKind::timer) continue;
    const double response = bounds.tasks[id] ? to_ms(Duration(*bounds.tasks[id])) : INFINITY;
    const double late = response - to_ms(tasks.set[id].deadline);
    late_timers += late > 0 ? 1 : 0;
    value = std::max(value, late);
    tie += response;
  }
  const auto latencies = worst_latencies(objective, bounds);
  if (!latencies.empty()) std::tie(values.hot_path_ms, values.age_ms) = latencies[objective.chain];
  if (objective.kind == Objective::Kind::latency) {
    value = objective.of_hot_path() ? values.hot_path_ms : values.age_ms;
    tie = objective.of_hot_path() ? values.age_ms : values.hot_path_ms;
  } else if (objective.kind == Objective::Kind::requirements) {
    value = 0;
    for (const Objective::Requirement& r : objective.requirements)
      value = std::max(value, 100 * latencies[r.chain].second / r.most_ms);
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

/// What a search has evaluated.
class KnownPhases {
 public:
  KnownPhases(const EvaluatePhases& evaluate, unsigned threads) : evaluate_(evaluate), threads_(threads) {}

  /// Evaluates what is not known so far.
  std::vector<PhaseValues> at(const std::vector<FirstTimestamps>& points, const PhaseScore& enough) {
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
  [[nodiscard]] std::size_t evaluations() const { return evaluations_; }

 private:
  struct Known {
    PhaseValues values;
    PhaseScore enough;
    [[nodiscard]] bool suffices(const PhaseScore& other) const {
      return values.within_margin <= enough || other <= enough;
    }
  };
  const EvaluatePhases& evaluate_;
  const unsigned threads_;
  std::map<FirstTimestamps, Known> known_;
  std::size_t evaluations_ = 0;
};

}  // namespace

FoundPhases search_phases(const TaskSet& set, const std::vector<TaskId>& together,
                          const std::vector<FirstTimestamps>& starts, const EvaluatePhases& evaluate,
                          unsigned threads, const std::function<bool()>& stop) {
  std::vector<TaskId> timers;
  std::vector<std::vector<TaskId>> moves;  // timers that move together
  for (TaskId id = 0; id < set.size(); ++id) {
    if (set[id].kind != TaskKind::timer) continue;
    if (!timers.empty()) moves.push_back({id});  // the first timer stays: only differences matter
    timers.push_back(id);
  }
  if (together.size() > 1 && together.size() < timers.size()) moves.push_back(together);
  // Some timers later by a time, below their periods, on whole microseconds.
  const auto moved = [&](FirstTimestamps first, const std::vector<TaskId>& later, Duration by) {
    for (const TaskId id : later) {
      first[id] = std::chrono::floor<std::chrono::microseconds>(first[id] + by) % set[id].period;
      if (first[id] < Duration{}) first[id] += set[id].period;
    }
    return first;
  };
  FoundPhases found;
  KnownPhases known(evaluate, threads);
  // Empty: the search was stopped.
  const auto evaluated = [&](const std::vector<FirstTimestamps>& points, const PhaseScore& enough) {
    found.complete = found.complete && !stop();
    return found.complete ? known.at(points, enough) : std::vector<PhaseValues>();
  };
  // Moves one timer after the other until no timer improves the score.
  const auto descended = [&](PhaseValues best, std::int64_t steps) {
    for (std::size_t i = 0, idle = 0; idle < moves.size(); ++i, ++idle) {
      const std::vector<TaskId>& move = moves[i % moves.size()];
      const auto step = std::chrono::floor<std::chrono::microseconds>(range_of_phases(set, move) / steps);
      std::vector<FirstTimestamps> points;
      for (int k = -kPoints / 2; k <= kPoints / 2; ++k)
        points.push_back(moved(best.first, move, k * std::max(step, std::chrono::microseconds(1))));
      std::vector<PhaseValues> values = evaluated(points, best.within_margin);
      if (!found.complete) break;
      const auto least = std::ranges::min_element(values, {}, &PhaseValues::within_margin)->within_margin;
      std::size_t length = 0, longest = 0, middle = 0;  // of runs of points with this score
      for (std::size_t p = 0; p < values.size(); ++p) {
        length = values[p].within_margin == least ? length + 1 : 0;
        if (length > longest) middle = p - length / 2;
        longest = std::max(longest, length);
      }
      if (least < best.within_margin) idle = 0;
      if (least <= best.within_margin) best = std::move(values[middle]);
    }
    return best;
  };
  for (const FirstTimestamps& start : starts) {
    const std::vector<PhaseValues> values = evaluated({moved(start, timers, {})}, {});
    if (!found.complete) break;
    PhaseValues end = descended(values.front(), kSteps[0]);
    if (end.within_margin < found.values.within_margin) found.values = std::move(end);
  }
  for (std::size_t s = 0; found.complete && s < kSteps.size(); ++s)
    found.values = descended(std::move(found.values), kSteps[s]);
  found.evaluations = known.evaluations();
  return found;
}

}  // namespace hotpath::advise
