// SPDX-License-Identifier: Apache-2.0
#include "advise/phase_search.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numeric>
#include <tuple>

#include "hotpath/analysis/parallel.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::advise {

namespace {

using std::chrono::floor, std::chrono::microseconds;

constexpr std::int64_t kSide = 8;  // points of a grid on each side of the current phases
constexpr std::array<std::int64_t, 3> kSteps = {16, 128, 1024};  // of the grids, as parts of a timer's range

/// By chain of the graph: its worst hot path and age in ms; infinite: there is none.
std::vector<std::pair<double, double>> worst_latencies(const Graph& graph, const GraphTasks& tasks,
                                                       const GraphBounds& bounds) {
  std::vector<std::pair<double, double>> all(graph.chains.size(), {INFINITY, INFINITY});
  auto bound = bounds.chains.begin();
  for (const bounds::BoundedChain& chain : bounds::bounded_chains(graph, tasks)) {
    auto& [hot_path_ms, age_ms] = all[chain.number];
    const std::optional<ChainAge>& age = *bound++;
    if (age) age_ms = to_ms(Duration(age->latency));
    if (age && age->hot_path) hot_path_ms = to_ms(Duration(*age->hot_path));
  }
  return all;
}

/// The lateness of timers, decided by their response times.
Score score_of_timers(const TaskSet& set, const GraphBounds& bounds) {
  Score score{-INFINITY};
  for (const TaskId id : set.timers()) {
    const double response = bounds.tasks[id] ? to_ms(Duration(*bounds.tasks[id])) : INFINITY;
    const double late = response - to_ms(set[id].deadline);
    score.late_timers += late > 0 ? 1 : 0;
    score.value = std::max(score.value, late);
    score.tie += response;
  }
  return score;
}

/// Some timers later by a time, below their periods, on whole microseconds.
FirstTimestamps moved(const TaskSet& set, FirstTimestamps first, const std::vector<TaskId>& later,
                      Duration by) {
  for (const TaskId id : later) {
    first[id] = floor<microseconds>(first[id] + by) % set[id].period;
    if (first[id] < Duration{}) first[id] += set[id].period;
  }
  return first;
}

/// The middle of the longest run of values with the least score.
PhaseValues& middle_of_best(std::vector<PhaseValues>& values) {
  const auto least = std::ranges::min_element(values, {}, &PhaseValues::within_margin)->within_margin;
  std::size_t length = 0, longest = 0, middle = 0;
  for (std::size_t p = 0; p < values.size(); ++p) {
    length = values[p].within_margin == least ? length + 1 : 0;
    if (length > longest) middle = p - length / 2;
    longest = std::max(longest, length);
  }
  return values[middle];
}

}  // namespace

PhaseValues exact_values(const Candidate& candidate, const Objective& objective, const FirstTimestamps& first,
                         std::vector<bounds::ReachedWorstCase>* reached) {
  PhaseValues values{.first = first, .refusal = candidate.load.overload};
  if (!candidate.spec.entry) values.refusal = "a deployment of executors is not explored";
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
  const auto worst = worst_latencies(candidate.graph, tasks, bounds);
  if (!worst.empty()) std::tie(values.hot_path_ms, values.age_ms) = worst[objective.chain];
  if (objective.kind == Objective::Kind::latency) {
    std::tie(value, tie) = std::pair(values.age_ms, values.hot_path_ms);
    if (objective.latency == Latency::hot_path) std::swap(value, tie);
  } else if (objective.kind == Objective::Kind::requirements) {
    value = 0;
    for (const Objective::Requirement& r : objective.requirements)
      value = std::max(value, 100 * worst[r.chain].second / r.most_ms);
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
    for (const TaskId other : set.timers()) {
      if (std::ranges::count(moved, other) > 0) continue;
      const std::int64_t common = std::gcd(period, set[other].period.count());
      if (__builtin_mul_overflow(range / std::gcd(range, common), common, &range)) return Duration(longest);
      range = std::min(range, longest);
    }
  }
  return Duration(range);
}

PhaseValues search_phases(const TaskSet& set, const std::vector<TaskId>& together,
                          const std::vector<FirstTimestamps>& starts, const EvaluatePhases& evaluate,
                          unsigned threads, const std::function<bool()>& stop) {
  const std::vector<TaskId> timers = set.timers();
  std::vector<std::vector<TaskId>> moves;  // not of the first timer, since only differences matter
  for (std::size_t i = 1; i < timers.size(); ++i) moves.push_back({timers[i]});
  if (together.size() > 1 && together.size() < timers.size()) moves.push_back(together);
  bool complete = true;
  const auto goes_on = [&] { return complete = complete && !stop(); };
  // Moves one timer after the other until no timer improves the score.
  const auto descend = [&](PhaseValues& best, std::int64_t steps) {
    for (std::size_t i = 0, idle = 0; idle < moves.size() && goes_on(); ++i, ++idle) {
      const std::vector<TaskId>& move = moves[i % moves.size()];
      const auto step = std::max(floor<microseconds>(range_of_phases(set, move) / steps), microseconds(1));
      std::vector<PhaseValues> grid(2 * kSide + 1, best);
      for_each_index(grid.size(), threads, [&](std::size_t p) {
        const auto k = static_cast<std::int64_t>(p) - kSide;
        if (k != 0) grid[p] = evaluate(moved(set, best.first, move, k * step), best.within_margin);
      });
      PhaseValues& middle = middle_of_best(grid);
      if (middle.within_margin < best.within_margin) idle = 0;
      best = std::move(middle);
    }
  };
  PhaseValues found;
  for (const FirstTimestamps& start : starts) {
    if (!goes_on()) break;
    PhaseValues end = evaluate(moved(set, start, timers, {}), {});
    descend(end, kSteps[0]);
    if (end.within_margin < found.within_margin) found = std::move(end);
  }
  for (const std::int64_t steps : kSteps) descend(found, steps);
  found.complete = complete;
  return found;
}

}  // namespace hotpath::advise
