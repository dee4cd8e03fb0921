// SPDX-License-Identifier: Apache-2.0
#include "advise/objective.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "hotpath/core/enum_text.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::advise {

namespace {

using Kind = Objective::Kind;
using Statistic = Objective::Statistic;

[[noreturn]] void refuse(const std::string& text) {
  throw program::UsageError(program::concat(
      "--for: `", text,
      "`: give CHAIN:age:median, :p99 or :worst, CHAIN:p99 for its hot path, CHAIN<MS, worst_lateness or "
      "losses"));
}

/// `note` gets what is meant if it is another chain.
std::size_t chain_named(const std::string& name, const Graph& graph, std::string& note) {
  std::vector<std::string> names;
  for (const Chain& chain : graph.chains) names.push_back(chain.name);
  const auto place = std::ranges::find(names, name);
  if (place != names.end()) return static_cast<std::size_t>(place - names.begin());
  if (name == "hot_path" && !names.empty()) {
    note = "--for: the graph has no chain hot_path; its first chain is meant, " + names.front();
    return 0;
  }
  throw program::UsageError(
      program::concat("--for: the graph has no chain ", name, "; ",
                      names.empty() ? "it names none, and none was found: take worst_lateness or losses"
                                    : "it has " + program::joined(names)));
}

Objective latency_of(const std::string& chain, const std::string& words, const Graph& graph,
                     Statistic usual) {
  const bool age = words == "age" || words.starts_with("age:");
  const auto statistic = words == "age" ? usual : parse<Statistic>(age ? words.substr(4) : words);
  if (!statistic) refuse(words);
  Objective objective{.statistic = *statistic, .latency = age ? Latency::age : Latency::hot_path};
  objective.chain = chain_named(chain, graph, objective.note);
  objective.text = program::concat(metric_text(objective.latency), " of ", graph.chains[objective.chain].name,
                                   " (", to_string(*statistic), ")");
  return objective;
}

Objective::Requirement requirement(const std::string& text, const Graph& graph, std::string& note) {
  const std::size_t less = text.find('<');
  if (less == std::string::npos) refuse(text);
  Objective::Requirement r;
  r.most_ms = parse<double>(std::string_view(text).substr(less + 1)).value_or(0);
  if (!(r.most_ms > 0)) refuse(text);
  r.chain = chain_named(text.substr(0, less), graph, note);
  return r;
}

double finite(double value) { return std::isnan(value) ? INFINITY : value; }

double worst_lateness(const results::ExecutorSummary& summary) {
  double worst = -INFINITY;
  for (const results::TaskSummary& task : summary.tasks) {
    if (task.kind != TaskKind::timer) continue;
    if (task.never_ran()) return INFINITY;
    if (task.response_ms.n > 0) worst = std::max(worst, task.response_ms.max - to_ms(task.deadline));
  }
  return worst;
}

}  // namespace

const QuantileTraits& quantile_of(Statistic statistic) {
  const double probability = statistic == Statistic::median ? 0.5 : statistic == Statistic::p99 ? 0.99 : 1;
  return *std::ranges::find(kQuantiles, probability, &QuantileTraits::probability);
}

const char* metric_text(Latency latency) {
  return latency == Latency::age ? "age of the data" : "hot-path latency";
}

Objective parse_objective(const std::optional<std::string>& given, const Graph& graph, Statistic usual) {
  if (!given && !graph.chains.empty()) return latency_of(graph.chains.front().name, "age", graph, usual);
  const std::string text = given.value_or("worst_lateness");
  if (text == "losses") return {.kind = Kind::losses, .text = "lost jobs and samples"};
  if (text == "worst_lateness") return {.kind = Kind::worst_lateness, .text = "worst lateness of timers"};
  const std::size_t colon = text.find(':');
  if (colon != std::string::npos)
    return latency_of(text.substr(0, colon), text.substr(colon + 1), graph, usual);
  Objective objective{.kind = Kind::requirements, .statistic = Statistic::worst};
  std::istringstream items(text);
  for (std::string item; std::getline(items, item, ',');) {
    const Objective::Requirement r = requirement(item, graph, objective.note);
    objective.text += program::concat(objective.text.empty() ? "" : ", ", graph.chains[r.chain].name,
                                      " within ", r.most_ms, " ms");
    objective.requirements.push_back(r);
  }
  if (objective.requirements.empty()) refuse(text);
  objective.chain = objective.requirements.front().chain;
  return objective;
}

Score score(const Objective& objective, const results::ExecutorSummary& summary) {
  const double lost = summary.lost_percent();
  switch (objective.kind) {
    case Kind::latency:
      return {finite(summary.chains[objective.chain].latency(objective.latency).quantiles.*
                     quantile_of(objective.statistic).of),
              0, lost};
    case Kind::worst_lateness:
      return {worst_lateness(summary), 0, lost};
    case Kind::losses:
      return {lost, 0, worst_lateness(summary)};
    case Kind::requirements:
      break;
  }
  Score score{0};
  for (const Objective::Requirement& r : objective.requirements) {
    const double worst = finite(summary.chains[r.chain].end_to_end.quantiles.max) / r.most_ms;
    score.value += std::max(0.0, 100 * (worst - 1));
    score.tie = std::max(score.tie, worst);
  }
  return score;
}

}  // namespace hotpath::advise
