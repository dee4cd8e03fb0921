// SPDX-License-Identifier: Apache-2.0
#include "advise/advice_report.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "advise/ranking.hpp"
#include "program/text.hpp"
#include "program/text_table.hpp"

namespace hotpath::advise {

namespace {

using nlohmann::json;

/// Number of tasks that never ran, and timers with a job that waited longer than a period.
std::size_t waited_long(const results::ExecutorSummary& summary) {
  return static_cast<std::size_t>(std::ranges::count_if(summary.tasks, [](const results::TaskSummary& t) {
    return t.never_ran() || (t.period > Duration::zero() && t.longest_wait > t.period);
  }));
}

bool shows_end_to_end(const Objective& objective) {
  return objective.kind == Objective::Kind::requirements || objective.statistic == Objective::Statistic::age;
}

const results::LatencySummary& latency(const Advice& advice, const Prediction& p) {
  const results::ChainSummary& chain = p.summary.chains[advice.objective.chain];
  return shows_end_to_end(advice.objective) ? chain.end_to_end : chain.hot_path;
}

program::TextTable::Cell with_interval(double value, const std::optional<Interval>& interval) {
  if (!interval) return program::fixed(value, 1);
  return {program::fixed(value, 1), program::concat("[", program::fixed(interval->low, 1), ", ",
                                                    program::fixed(interval->high, 1), "]")};
}

json json_of(double value, const std::optional<Interval>& interval) {
  json j = {{"value", value}};
  if (interval) j["interval"] = {interval->low, interval->high};
  return j;
}

program::TextTable ranking_table(const Advice& advice) {
  const bool chains = !advice.graph.chains.empty();
  const bool lateness = advice.objective.kind == Objective::Kind::worst_lateness;
  const std::string chain = chains ? advice.graph.chains[advice.objective.chain].name : "";
  program::TextTable table(
      program::concat(chains ? chain : advice.graph.name, ": ",
                      !chains                              ? "jobs"
                      : shows_end_to_end(advice.objective) ? "end-to-end latency in ms"
                                                           : "hot-path latency in ms",
                      ", best first by ", advice.objective.text),
      {"", chains ? "median" : "", chains ? "p99" : "", chains ? "worst" : "",
       lateness ? "worst\nlateness ms" : "", "lost\n%", "timers\nlate", "never\nran", "threads",
       "cores\nused", program::concat("bound\n", bounded_latency(advice.objective))});
  for (const Prediction* p : advice.ranked) {
    if (!p->overload.empty()) continue;
    program::TextTable::Cell median = "", p99 = "", worst = "";
    if (chains) {
      const results::LatencySummary& l = latency(advice, *p);
      median = with_interval(l.quantiles.p50, l.p50);
      p99 = with_interval(l.quantiles.p99, l.p99);
      worst = with_interval(l.quantiles.max, l.max);
    }
    const std::size_t never_started = never_ran(p->summary);
    table.add_row({p->candidate->name, median, p99, worst,
                   lateness ? program::fixed(score(advice.objective, p->summary).value, 1) : "",
                   program::fixed(loss_percent(p->summary), 1), std::to_string(waited_long(p->summary)),
                   never_started > 0 ? std::to_string(never_started) : "",
                   std::to_string(p->candidate->threads), program::fixed(p->cores_used, 2),
                   p->bound_ms ? program::fixed(*p->bound_ms, 1) : ""});
  }
  return table;
}

/// Lists overloaded candidates, and candidates with better scores that cannot be recommended.
void write_excluded(std::ostream& out, const Advice& advice) {
  std::map<std::string, std::vector<std::string>> overloaded;
  for (const Prediction* p : advice.ranked) {
    if (!p->overload.empty()) overloaded[p->overload].push_back(p->candidate->name);
  }
  for (const auto& [cause, names] : overloaded)
    out << program::joined(names) << " cannot keep up: " << cause << "\n";
  for (const Prediction* p : advice.ranked) {
    if (p == advice.best || !p->overload.empty()) break;
    const std::string cause = why_not(*p, *advice.now);
    if (!cause.empty()) out << p->candidate->name << " is not recommended: " << cause << "\n";
  }
}

/// By timer: the least and greatest distance of its starts.
json periods_json(const results::ExecutorSummary& summary) {
  json all = json::object();
  for (const results::TaskSummary& task : summary.tasks) {
    if (!std::isfinite(task.period_range_ms())) continue;
    all[task.task] = {
        {"period", to_ms(task.period)}, {"least", task.period_ms->min}, {"greatest", task.period_ms->max}};
  }
  return all;
}

}  // namespace

void write_ranking(std::ostream& out, const Advice& advice) {
  out << ranking_table(advice) << "\n";
  write_excluded(out, advice);
  out << "\n";
  for (const std::string& sentence : sentences(advice)) out << sentence << "\n";
  for (const Doubt& doubt : advice.doubts) {
    out << "With " << doubt.assumption << ": " << program::joined(doubt.values) << ".\n";
  }
  if (!advice.causes.empty()) out << "\n" << program::joined(advice.causes, "\n") << "\n";
  if (!advice.change.empty()) out << "\nChange: " << advice.change << "\n";
}

json advice_json(const Advice& advice) {
  json all = {
      {"graph", advice.graph.name},
      {"objective", advice.objective.text},
      {"draws", advice.draws},
      {"asked_draws", advice.asked_draws},
      {"seconds", advice.seconds},
      {"cores", advice.graph.platform.cores},
      {"now", advice.now->candidate->name},
      {"recommended", advice.best == nullptr ? json() : json(advice.best->candidate->name)},
      {"sentences", sentences(advice)},
      {"causes", advice.causes},
      {"change", advice.change},
      {"stored", advice.stored},
      {"chain",
       advice.graph.chains.empty() ? json() : json(advice.graph.chains[advice.objective.chain].name)}};
  all["requirements_ms"] = json::object();
  for (const Objective::Requirement& r : advice.objective.requirements)
    all["requirements_ms"][advice.graph.chains[r.chain].name] = r.most_ms;
  all["doubts"] = json::array();
  for (const Doubt& d : advice.doubts) {
    all["doubts"].push_back({{"assumption", d.assumption}, {"order", d.order}, {"same_first", d.same_first}});
  }
  for (const Prediction* p : advice.ranked) {
    json row = {{"name", p->candidate->name},
                {"description", p->candidate->description},
                {"threads", p->candidate->threads},
                {"overload", p->overload}};
    if (p->overload.empty()) {
      row["objective"] = score(advice.objective, p->summary).value;
      row["lost_percent"] = loss_percent(p->summary);
      row["timers_late"] = waited_long(p->summary);
      row["never_ran"] = never_ran(p->summary);
      row["cores_used"] = p->cores_used;
      row["bound_ms"] = p->bound_ms ? json(*p->bound_ms) : json();
      row["bound_method"] = p->bound_method;
      row["bound_of"] = bounded_latency(advice.objective);
      row["periods_ms"] = periods_json(p->summary);
      if (!advice.graph.chains.empty()) {
        const results::LatencySummary& l = latency(advice, *p);
        row["median_ms"] = json_of(l.quantiles.p50, l.p50);
        row["p99_ms"] = json_of(l.quantiles.p99, l.p99);
        row["worst_ms"] = json_of(l.quantiles.max, l.max);
      }
    }
    all["ranking"].push_back(std::move(row));
  }
  return all;
}

}  // namespace hotpath::advise
