// SPDX-License-Identifier: Apache-2.0
#include "advise/advice_report.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "advise/ranking.hpp"
#include "program/text.hpp"
#include "program/text_table.hpp"

namespace hotpath::advise {

namespace {

using nlohmann::json;
using program::concat, program::fixed, program::joined;

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
  if (!interval) return fixed(value, 1);
  return {fixed(value, 1), concat("[", fixed(interval->low, 1), ", ", fixed(interval->high, 1), "]")};
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
  program::TextTable table(concat(chains ? chain : advice.graph.name, ": ",
                                  !chains                              ? "jobs"
                                  : shows_end_to_end(advice.objective) ? "end-to-end latency in ms"
                                                                       : "hot-path latency in ms",
                                  ", best first by ", advice.objective.text),
                           {"", chains ? "median" : "", chains ? "p99" : "", chains ? "worst" : "",
                            lateness ? "worst\nlateness ms" : "", "lost\n%", "timers\nlate", "never\nran",
                            "threads", "cores\nused", concat("bound\n", bounded_latency(advice.objective))});
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
                   lateness ? fixed(score(advice.objective, p->summary).value, 1) : "",
                   fixed(loss_percent(p->summary), 1), std::to_string(waited_long(p->summary)),
                   never_started > 0 ? std::to_string(never_started) : "",
                   std::to_string(p->candidate->threads), fixed(p->cores_used, 2),
                   p->bound_ms ? fixed(*p->bound_ms, 1) : ""});
  }
  return table;
}

/// Lists overloaded candidates, and candidates with better scores that cannot be recommended.
void write_excluded(std::ostream& out, const Advice& advice) {
  std::map<std::string, std::vector<std::string>> overloaded;
  for (const Prediction* p : advice.ranked) {
    if (!p->overload.empty()) overloaded[p->overload].push_back(p->candidate->name);
  }
  for (const auto& [cause, names] : overloaded) out << joined(names) << " cannot keep up: " << cause << "\n";
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

std::string lost(const Prediction& p) { return fixed(loss_percent(p.summary), 1) + " %"; }

std::string compared_with_now(const Advice& advice) {
  const Prediction &best = *advice.best, &now = *advice.now;
  if (!now.overload.empty()) return concat(", where ", now.candidate->name, " cannot keep up");
  const double before = score(advice.objective, now.summary).value,
               after = score(advice.objective, best.summary).value;
  std::string text = concat(" instead of ", value_text(advice.objective, now), " with ", now.candidate->name);
  const bool relative =
      advice.objective.kind == Objective::Kind::latency && before > 0 && std::isfinite(before);
  return relative ? text + concat(" (", fixed(100 * (1 - after / before), 0), " % less)") : text;
}

std::string first_sentence(const Advice& advice) {
  const std::string objective = advice.objective.text;
  if (advice.best == nullptr) {
    return concat("No change can be recommended for ", objective,
                  ": no candidate keeps up, runs every task and loses no more than today.");
  }
  const Prediction& best = *advice.best;
  const std::string value = value_text(advice.objective, best);
  if (&best == advice.now) {
    return concat("Keep ", best.candidate->name, ": no other suitable candidate makes ", objective,
                  " smaller than its ", value, " beyond noise.");
  }
  return concat("Take ", best.candidate->name, " (", best.candidate->description, "): ", objective,
                " becomes ", value, compared_with_now(advice), ".");
}

std::string second_sentence(const Advice& advice) {
  const Prediction& best = *advice.best;
  std::string text = concat("The prediction is based on ", advice.draws,
                            advice.draws == 1 ? " draw" : " draws", " of phases and execution times");
  const auto next = std::ranges::find_if(advice.ranked, [&](const Prediction* p) {
    return p != &best && p->overload.empty() && why_not(*p, *advice.now).empty();
  });
  if (next != advice.ranked.end()) {
    const auto distinct = differs(advice.objective, best, **next);
    text += concat("; the best alternative is ", (*next)->candidate->name, " with ",
                   value_text(advice.objective, **next),
                   !distinct   ? ""
                   : *distinct ? ", a difference beyond noise"
                               : ", a difference within noise");
  }
  text += best.bound_ms ? concat("; theory guarantees ", fixed(*best.bound_ms, 1), " ms ",
                                 advice.objective.of_hot_path() ? "on the hot path" : "end to end", " (",
                                 best.bound_method, ")")
                        : "; theory gives no bound";
  return text + ".";
}

std::string third_sentence(const Advice& advice) {
  const Prediction &best = *advice.best, &now = *advice.now;
  std::string text =
      concat("It needs ", best.candidate->threads, best.candidate->threads == 1 ? " thread" : " threads");
  const auto& deployment = best.candidate->spec.deployment;
  if (deployment && std::ranges::any_of(deployment->plan.executors,
                                        [](const DeployedExecutor& e) { return !e.policy.ordinary(); })) {
    text += " with the right to SCHED_FIFO";
  }
  text += concat(" and loses ", lost(best), " of all jobs and samples");
  if (&best != &now && now.overload.empty()) text += concat(" (today ", lost(now), ")");
  std::string overtaken;
  for (const Doubt& doubt : advice.doubts) {
    if (!doubt.same_first) overtaken += (overtaken.empty() ? "" : " and ") + doubt.assumption;
  }
  if (advice.doubts.empty()) return text + ".";
  return text + (overtaken.empty() ? "; no other candidate overtakes it under the assumptions below."
                                   : "; another candidate overtakes it with " + overtaken + ".");
}

/// Names the timers whose period varies clearly more than today, the worst first.
std::string who_pays(const Advice& advice) {
  constexpr double kShare = 0.05;  // of the period: less does not matter to a periodic callback
  constexpr std::size_t kMost = 3;
  const Prediction &best = *advice.best, &now = *advice.now;
  if (&best == &now || !now.overload.empty()) return "";
  std::vector<std::pair<double, std::string>> paying;  // by the growth as a share of the period
  std::size_t timers = 0;
  for (std::size_t t = 0; t < best.summary.tasks.size(); ++t) {
    const results::TaskSummary &after = best.summary.tasks[t], &before = now.summary.tasks[t];
    timers += after.kind == TaskKind::timer;
    const double growth = (after.period_range_ms() - before.period_range_ms()) / to_ms(after.period);
    if (!(growth > kShare)) continue;  // nor without two jobs
    paying.emplace_back(growth, concat(after.task, "'s period varies by ", fixed(after.period_range_ms(), 1),
                                       " ms instead of ", fixed(before.period_range_ms(), 1), " ms"));
  }
  if (timers == 0) return "";
  if (paying.empty()) return "No timer pays for it: no period varies clearly more than today.";
  std::ranges::stable_sort(paying, std::greater(), &std::pair<double, std::string>::first);
  const std::size_t more = paying.size() - std::min(kMost, paying.size());
  paying.resize(std::min(kMost, paying.size()));
  std::string text = "Timers pay for it: ";
  for (const auto& [growth, sentence] : paying) text += (text.ends_with(": ") ? "" : "; ") + sentence;
  return text + (more > 0 ? concat("; and ", more, " more.") : ".");
}

}  // namespace

void write_ranking(std::ostream& out, const Advice& advice) {
  out << ranking_table(advice) << "\n";
  write_excluded(out, advice);
  out << "\n";
  for (const std::string& sentence : sentences(advice)) out << sentence << "\n";
  for (const Doubt& doubt : advice.doubts) {
    out << "With " << doubt.assumption << ": " << joined(doubt.values) << ".\n";
  }
  if (!advice.causes.empty()) out << "\n" << joined(advice.causes, "\n") << "\n";
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

const char* bounded_latency(const Objective& objective) {
  return objective.of_hot_path() ? "hot path" : "end to end";
}

std::string value_text(const Objective& objective, const Prediction& p) {
  const Score value = score(objective, p.summary);
  switch (objective.kind) {
    case Objective::Kind::losses:
      return fixed(value.value, 2) + " %";
    case Objective::Kind::requirements:
      return value.value > 0 ? concat("missed by ", fixed(value.value, 1), " % in all")
                             : concat("met with ", fixed(100 * (1 - value.tie), 0), " % to spare");
    case Objective::Kind::latency:
    case Objective::Kind::worst_lateness:
      break;
  }
  return std::isfinite(value.value) ? fixed(value.value, 1) + " ms" : "no value";
}

std::vector<std::string> sentences(const Advice& advice) {
  if (advice.best == nullptr) return {first_sentence(advice)};
  std::vector<std::string> all = {first_sentence(advice), second_sentence(advice), third_sentence(advice)};
  if (std::string paying = who_pays(advice); !paying.empty()) all.push_back(std::move(paying));
  return all;
}

}  // namespace hotpath::advise
