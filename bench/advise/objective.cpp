// SPDX-License-Identifier: Apache-2.0
#include "advise/objective.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>

#include "hotpath/reference_system/chain_observation.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::advise {

namespace {

using Statistic = Objective::Statistic;

constexpr std::array<std::pair<const char*, Statistic>, 4> kStatistics = {{{"median", Statistic::median},
                                                                           {"p99", Statistic::p99},
                                                                           {"worst", Statistic::worst},
                                                                           {"age", Statistic::age}}};
constexpr const char* kForms =
    "give hot_path:median, :p99, :worst or :age, CHAIN:p99, CHAIN<MS, worst_lateness or losses";
constexpr const char* kFirst = "hot_path";

std::size_t chain_named(const std::string& name, const Graph& graph) {
  std::vector<std::string> names;
  for (const Chain& chain : graph.chains) names.push_back(chain.name);
  const auto place = std::ranges::find(names, name);
  if (place != names.end()) return static_cast<std::size_t>(place - names.begin());
  if (name == kFirst && !names.empty()) return 0;
  throw program::UsageError(
      program::concat("--for: the graph has no chain ", name, "; ",
                      names.empty() ? "it names none, and none was found: take worst_lateness or losses"
                                    : "it has " + program::joined(names)));
}

Objective latency_of(const std::string& chain, const std::string& statistic, const Graph& graph) {
  const auto named = std::ranges::find_if(kStatistics, [&](const auto& s) { return statistic == s.first; });
  if (named == kStatistics.end())
    throw program::UsageError(program::concat("--for: `", statistic, "`: ", kForms));
  Objective objective;
  objective.statistic = named->second;
  objective.chain = chain_named(chain, graph);
  objective.text = program::concat(objective.of_hot_path() ? named->first : "greatest age", " of ",
                                   graph.chains[objective.chain].name);
  return objective;
}

Objective::Requirement requirement(const std::string& text, const Graph& graph) {
  const std::size_t less = text.find('<');
  Objective::Requirement r;
  const char* const end = text.data() + text.size();
  const auto parsed = less == std::string::npos ? std::from_chars_result{}
                                                : std::from_chars(text.data() + less + 1, end, r.most_ms);
  if (parsed.ptr != end || parsed.ec != std::errc{} || !(r.most_ms > 0)) {
    throw program::UsageError(program::concat("--for: `", text, "`: ", kForms));
  }
  r.chain = chain_named(text.substr(0, less), graph);
  return r;
}

double finite(double value) { return std::isnan(value) ? std::numeric_limits<double>::infinity() : value; }

double worst_lateness(const results::ExecutorSummary& summary) {
  double worst = -std::numeric_limits<double>::infinity();
  for (const results::TaskSummary& task : summary.tasks) {
    if (task.kind != TaskKind::timer) continue;
    if (task.never_ran()) return std::numeric_limits<double>::infinity();
    if (task.response_ms.n > 0) worst = std::max(worst, task.response_ms.max - to_ms(task.deadline));
  }
  return worst;
}

Objective objective_of(const std::string& text, const Graph& graph) {
  Objective objective;
  if (text == "worst_lateness" || text == "losses") {
    objective.kind = text == "losses" ? Objective::Kind::losses : Objective::Kind::worst_lateness;
    objective.text = text == "losses" ? "lost jobs and samples" : "worst lateness of timers";
    return objective;
  }
  const std::size_t colon = text.find(':');
  if (colon != std::string::npos) return latency_of(text.substr(0, colon), text.substr(colon + 1), graph);
  objective.kind = Objective::Kind::requirements;
  std::istringstream items(text);
  for (std::string item; std::getline(items, item, ',');) {
    const Objective::Requirement r = requirement(item, graph);
    objective.text += program::concat(objective.text.empty() ? "" : ", ", graph.chains[r.chain].name,
                                      " within ", r.most_ms, " ms");
    objective.requirements.push_back(r);
  }
  if (objective.requirements.empty())
    throw program::UsageError(program::concat("--for: `", text, "`: ", kForms));
  objective.chain = objective.requirements.front().chain;
  return objective;
}

}  // namespace

Objective parse_objective(const std::string& text, const Graph& graph) {
  Objective objective = objective_of(text, graph);
  const GraphTasks tasks = make_tasks(graph);
  for (const ChainIndex& chain : index_chains(graph, tasks)) {
    objective.from_timers.push_back(
        std::ranges::all_of(chain.sources, [&](TaskId id) { return tasks.set[id].kind == TaskKind::timer; }));
  }
  return objective;
}

double loss_percent(const results::ExecutorSummary& summary) {
  const std::uint64_t lost = summary.skipped + summary.overwritten;
  return results::percent_of(lost, summary.executed + lost);
}

double statistic_of(Statistic statistic, const results::ChainSummary& chain) {
  if (statistic == Statistic::age) return chain.end_to_end.quantiles.max;
  const Quantiles& q = chain.hot_path.quantiles;
  return statistic == Statistic::median ? q.p50 : statistic == Statistic::p99 ? q.p99 : q.max;
}

Score score(const Objective& objective, const results::ExecutorSummary& summary) {
  switch (objective.kind) {
    case Objective::Kind::latency:
      return {finite(statistic_of(objective.statistic, summary.chains[objective.chain])),
              loss_percent(summary)};
    case Objective::Kind::worst_lateness:
      return {worst_lateness(summary), loss_percent(summary)};
    case Objective::Kind::losses:
      return {loss_percent(summary), worst_lateness(summary)};
    case Objective::Kind::requirements:
      break;
  }
  Score score;
  for (const Objective::Requirement& r : objective.requirements) {
    const double worst = finite(summary.chains[r.chain].end_to_end.quantiles.max) / r.most_ms;
    score.value += std::max(0.0, 100 * (worst - 1));
    score.tie = std::max(score.tie, worst);
  }
  return score;
}

}  // namespace hotpath::advise
