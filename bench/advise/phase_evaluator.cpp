// SPDX-License-Identifier: Apache-2.0
#include "advise/phase_evaluator.hpp"

#include <algorithm>

#include "hotpath/reference_system/chain_observation.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::advise {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// As exact_worst_cases() numbers them: chains that begin in timers, in the order of the graph.
std::vector<std::optional<std::size_t>> rows_of_chains(const Graph& graph, const GraphTasks& tasks) {
  std::vector<std::optional<std::size_t>> rows;
  std::size_t next = 0;
  for (const ChainIndex& chain : index_chains(graph, tasks)) {
    const bool timers =
        std::ranges::all_of(chain.sources, [&](TaskId id) { return tasks.set[id].kind == TaskKind::timer; });
    rows.push_back(timers ? std::optional(next++) : std::nullopt);
  }
  return rows;
}

}  // namespace

void check_guaranteed(const Objective& objective, const Graph& graph) {
  const auto fail = [](const std::string& problem) {
    throw program::UsageError("--for: with --phases, " + problem);
  };
  if (objective.kind == Objective::Kind::losses) {
    fail(
        "exact worst cases bound latencies and response times, not losses; give CHAIN:worst, CHAIN:age, "
        "CHAIN<MS or worst_lateness");
  }
  if (objective.kind == Objective::Kind::latency && objective.statistic != Objective::Statistic::worst &&
      objective.statistic != Objective::Statistic::age) {
    fail("only worst cases are guaranteed; give CHAIN:worst or CHAIN:age");
  }
  if (objective.kind == Objective::Kind::worst_lateness) return;
  const auto rows = rows_of_chains(graph, make_tasks(graph));
  const auto check = [&](std::size_t chain) {
    if (!rows[chain]) {
      fail(program::concat(
          "chain ", graph.chains[chain].name,
          " has no exact worst case, because it begins in a subscription; give another chain"));
    }
  };
  check(objective.chain);
  for (const Objective::Requirement& r : objective.requirements) check(r.chain);
}

PhaseEvaluator::PhaseEvaluator(const Candidate& candidate, const Objective& objective)
    : candidate_(candidate), objective_(objective), rows_(rows_of_chains(candidate.graph, candidate.tasks)) {}

PhaseValues PhaseEvaluator::at(const std::vector<Duration>& first,
                               std::vector<bounds::ReachedWorstCase>* reached) const {
  PhaseValues values;
  values.refusal = candidate_.overload;
  if (candidate_.spec.deployment) values.refusal = "a deployment of executors is not explored";
  if (!values.refusal.empty()) return values;
  GraphTasks tasks = candidate_.tasks;
  setup::set_phases(tasks.set, first);
  const GraphBounds bounds =
      bounds::exact_worst_cases(candidate_.graph, tasks, *candidate_.spec.entry, candidate_.spec.scheduler,
                                {.max_states = bounds::usual_state_limit(tasks.set)}, reached);
  values.refusal = bounds.refusal;
  if (!values.refusal.empty()) return values;
  for (const auto& response : bounds.tasks) {
    values.responses.push_back(response ? std::optional(Duration(*response)) : std::nullopt);
  }
  const auto row = rows_.empty() ? std::nullopt : rows_[objective_.chain];
  if (row && bounds.chains[*row]) {
    const ChainAge& chain = *bounds.chains[*row];
    values.age_ms = to_ms(Duration(chain.latency));
    if (chain.hot_path) values.hot_path_ms = to_ms(Duration(*chain.hot_path));
  }
  values.score = score(values, bounds);
  return values;
}

PhaseScore PhaseEvaluator::score(const PhaseValues& values, const GraphBounds& bounds) const {
  PhaseScore score{0, 0, 0};
  double worst_lateness = -kInfinite, responses = 0;
  for (TaskId id = 0; id < candidate_.tasks.set.size(); ++id) {
    const Task& task = candidate_.tasks.set[id];
    if (task.kind != TaskKind::timer) continue;
    const double response = values.responses[id] ? to_ms(*values.responses[id]) : kInfinite;
    score.late_timers += response > to_ms(task.deadline);
    worst_lateness = std::max(worst_lateness, response - to_ms(task.deadline));
    responses += response;
  }
  const double hot_path = values.hot_path_ms.value_or(kInfinite), age = values.age_ms.value_or(kInfinite);
  switch (objective_.kind) {
    case Objective::Kind::latency: {
      const bool of_age = objective_.statistic == Objective::Statistic::age;
      score.value = of_age ? age : hot_path;
      score.tie = of_age ? hot_path : age;
      break;
    }
    case Objective::Kind::worst_lateness:
    case Objective::Kind::losses:
      score.value = worst_lateness;
      score.tie = responses;
      break;
    case Objective::Kind::requirements:
      for (const Objective::Requirement& r : objective_.requirements) {
        const auto& chain = bounds.chains[*rows_[r.chain]];
        const double worst = (chain ? to_ms(Duration(chain->latency)) : kInfinite) / r.most_ms;
        score.value += std::max(0.0, 100 * (worst - 1));
        score.tie = std::max(score.tie, worst);
      }
  }
  return score;
}

}  // namespace hotpath::advise
