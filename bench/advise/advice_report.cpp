// SPDX-License-Identifier: Apache-2.0
#include "advise/advice_report.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "program/table.hpp"
#include "program/text.hpp"
#include "setup/deployed_system.hpp"

namespace hotpath::advise {

namespace {

using nlohmann::json;
using program::concat, program::fixed, program::joined, program::Table;
using results::words_of;

/// `1 thread`, `2 threads`.
std::string counted(std::uint64_t count, const char* thing) {
  return concat(count, " ", thing, count == 1 ? "" : "s");
}

/// The latency that the objective is not about.
Latency other_latency(const Objective& of) { return of.of_age() ? Latency::hot_path : Latency::age; }

/// The key of `chains_ms`.
std::string key_of(results::Judged statistic, Latency latency) {
  if (latency == Latency::hot_path) return to_string(statistic);
  return statistic == results::kWorst ? "age" : concat("age_", to_string(statistic));
}

/// The same statistic of a latency.
Objective latency_beside(const Advice& advice, Latency latency) {
  Objective of = advice.objective;
  of.kind = Objective::Kind::latency;
  of.latency = latency;
  return of;
}

/// What orders the candidates, after the name of chain and metric.
std::string order_of(const Objective& objective) {
  if (objective.kind == Objective::Kind::latency) return to_string(objective.statistic);
  return (objective.requirements.empty() ? "" : "proof, then ") + objective.text;
}

std::string name_of(const Prediction& p) { return p.candidate->name; }
std::string lost(const Prediction& p) { return fixed(p.summary.lost_percent(), 1) + " %"; }

/// The candidates that keep up; `ranking`: the content of advice.json.
Table ranking_table(const Advice& advice, const json& ranking) {
  const Objective& objective = advice.objective;
  const bool chains = !advice.graph.chains.empty();
  const bool lateness = objective.kind == Objective::Kind::worst_lateness;
  const std::string subject = chains ? advice.graph.chains[objective.chain].name : advice.graph.name;
  const std::string statistic = to_string(objective.statistic);
  Table table(concat(subject, ": ", chains ? concat(words_of(objective.latency).phrase, " in ms") : "jobs",
                     ", best first by ", order_of(objective), "; simulated, but for the bound"),
              {""});
  const auto add = [&](const std::vector<std::string>& names) {
    table.header.insert(table.header.end(), names.begin(), names.end());
  };
  if (chains) add(words<results::Judged>());
  if (chains) add({concat(to_string(other_latency(objective)), "\n", statistic)});
  if (lateness) add({"worst\nlateness ms"});
  add({"lost\n%", "timers\nlate", "never\nran", "threads", "cores\nused", "bound"});
  for (const json& p : ranking) {
    if (p["overload"] != "") continue;
    std::vector<program::Value> row = {p["name"]};
    for (const std::string& of : chains ? words<results::Judged>() : std::vector<std::string>()) {
      const json &latency = p[of + "_ms"], interval = latency.value("interval", json());
      row.emplace_back(
          fixed(latency["value"], 1),
          interval.is_null() ? "" : concat("[", fixed(interval[0], 1), ", ", fixed(interval[1], 1), "]"));
    }
    if (chains)
      row.emplace_back(
          fixed(p["chains_ms"][subject][key_of(objective.statistic, other_latency(objective))], 1));
    if (lateness) row.emplace_back(fixed(p["objective"], 1));
    row.insert(row.end(),
               {fixed(p["lost_percent"], 1), p["timers_late"], p["never_ran"] > 0 ? p["never_ran"] : json(),
                p["threads"], fixed(p["cores_used"], 2)});
    const bool exact = p["bound_method"] == bounds::kExactMethod;
    const std::string what = p.value("proven", false) ? "proven" : exact ? "exact" : "";
    row.emplace_back(p["bound_ms"].is_null() ? "" : fixed(p["bound_ms"], 1), what);
    table.add_row(row);
  }
  return table;
}

/// What excludes or limits candidates, each with its candidates, and candidates with better scores that
/// cannot be recommended.
void write_excluded(std::ostream& out, const Advice& advice) {
  std::map<std::string, std::vector<std::string>> causes;
  for (const Prediction& p : advice.ranked) {
    if (!p.keeps_up()) causes["cannot keep up: " + *p.overload].push_back(name_of(p));
    if (const std::string timer = timer_beside_group(*p.candidate); !timer.empty())
      causes["cannot be recommended: the timer thread runs " + timer +
             " beside the other callbacks of its mutually exclusive group, a data race"]
          .push_back(name_of(p));
    if (const auto tasks = results::starved(p.summary); !tasks.empty())
      causes["starves callbacks: " + joined(tasks)].push_back(name_of(p));
    if (!p.refusal.empty())
      causes[concat(p.bound ? "not exact: " : "without a bound: ", p.refusal)].push_back(name_of(p));
    if (!p.keeps_up() || (&p != advice.best && &p != advice.now)) continue;
    for (const std::string& sentence : p.candidate->load.warnings) out << sentence << "\n";
  }
  for (const auto& [cause, names] : causes) out << joined(names) << " " << cause << "\n";
  for (const Prediction& p : advice.ranked) {
    if (&p == advice.best || !p.keeps_up()) break;
    if (const auto cause = refusal(p, *advice.now); cause && !cause->empty())
      out << name_of(p) << " is not recommended: " << *cause << "\n";
  }
}

/// `10.0 ms instead of 20.0 ms`; the second one only if it is to be compared.
std::string gain(const Advice& advice, const Objective& of) {
  return value_text(of, *advice.best) +
         (advice.compares() ? " instead of " + value_text(of, *advice.now) : "");
}

std::string recommendation(const Advice& advice) {
  const Objective& of = advice.objective;
  const std::string objective = (of.kind == Objective::Kind::latency ? "the " : "") + of.text;
  if (advice.best == nullptr) {
    const std::string none =
        concat("No change can be recommended for ", objective, ": no candidate keeps up");
    const Prediction& first = advice.ranked.front();
    if (first.keeps_up()) return none + ", runs every task and loses no more than today.";
    const auto graph = setup::utilisation(advice.graph, advice.tasks, nullptr).overload;
    return concat(none, ", since ",
                  graph ? *graph
                        : concat("under ", name_of(first), " ", *first.overload,
                                 "; take candidates with more threads, or less work"),
                  ".");
  }
  const Candidate& best = *advice.best->candidate;
  if (!advice.changes()) {
    const std::string keep = concat("Keep ", best.name, ": no other suitable candidate ");
    return of.requirements.empty()
               ? concat(keep, "makes ", objective, " smaller than its ", gain(advice, of), " beyond noise.")
               : concat(keep, "is surer of ", objective, " than its ", gain(advice, of), ".");
  }
  const std::string taken =
      concat("Take ", best.name, " (", best.description, "): ", objective, " becomes ", gain(advice, of));
  if (!advice.compares()) return concat(taken, ", where ", name_of(*advice.now), " cannot keep up.");
  const double before = score(of, advice.now->summary).value, after = score(of, advice.best->summary).value;
  const bool relative = of.kind == Objective::Kind::latency && before > 0 && std::isfinite(before);
  return concat(taken, " with ", name_of(*advice.now),
                relative ? concat(" (", fixed(100 * (1 - after / before), 0), " % less)") : "", ".");
}

std::string confidence(const Advice& advice) {
  const Prediction& best = *advice.best;
  std::string text = concat("The prediction is based on ", counted(advice.draws(), "draw"),
                            " of phases and execution times");
  const auto next = std::ranges::find_if(advice.ranked, [&](const Prediction& p) {
    return &p != &best && p.keeps_up() && !refusal(p, *advice.now);
  });
  if (next != advice.ranked.end()) {
    const auto distinct = differs(advice.objective, best, *next);
    text += concat("; the best alternative is ", name_of(*next), ": ", value_text(advice.objective, *next),
                   !distinct   ? ""
                   : *distinct ? ", a difference beyond noise"
                               : ", a difference within noise");
  }
  if (!best.bound) return text + "; theory gives no bound.";
  text += concat("; by theory the ", words_of(advice.objective.latency).phrase, " never exceeds ",
                 fixed(to_ms(Duration(best.bound->ns)), 1), " ms (", best.bound->method, ")");
  if (advice.objective.requirements.empty()) return text + ".";
  return concat(text, ", so ", advice.objective.text, " is ", best.proven ? "" : "not ", "guaranteed.");
}

/// The metric that the objective is not about.
std::string other_metric(const Advice& advice) {
  if (advice.graph.chains.empty()) return "";
  const Objective of = latency_beside(advice, other_latency(advice.objective));
  return concat(of.of_age()
                    ? "Its age of the data, from the oldest source's timestamp to the output's finish: "
                    : "Its hot-path latency, from the latest source's start (the paper's metric): ",
                to_string(of.statistic), " ", gain(advice, of), ".");
}

/// The price of release-and-execute; empty: the recommended executors do not use it.
std::string timers_beside(const Advice& advice) {
  const auto executes = [](const setup::ExecutorSpec& part) {
    return part.entry->traits.timers == TimerHandling::release_and_execute;
  };
  if (std::ranges::none_of(setup::parts(advice.best->candidate->spec), executes)) return "";
  return "Timers run on a thread beside the executor thread (release-and-execute): data is younger, since a "
         "source does not wait for the callback that is running. In return, callbacks run at the same time: "
         "data that they share needs a lock. It is no option for a mutually exclusive group of timers and "
         "subscriptions.";
}

std::string cost(const Advice& advice) {
  const Prediction& best = *advice.best;
  std::string text = "It needs " + counted(best.candidate->load.threads, "thread");
  const auto real_time = [](const DeployedExecutor& e) { return !e.policy.ordinary(); };
  if (std::ranges::any_of(best.candidate->spec.plan.executors, real_time))
    text += " with the right to SCHED_FIFO";
  text += concat(" and loses ", lost(best), " of all jobs and samples");
  if (advice.compares()) text += concat(" (today ", lost(*advice.now), ")");
  if (advice.doubts.empty()) return text + ".";
  std::vector<std::string> overtaken;
  for (const Doubt& doubt : advice.doubts) {
    if (!doubt.same_first) overtaken.push_back(doubt.assumption);
  }
  if (overtaken.empty()) return text + "; no other candidate overtakes it under the assumptions below.";
  return concat(text, "; another candidate overtakes it with ", joined(overtaken, " and "), ".");
}

/// Names the timers whose period varies clearly more than today, the worst first; empty: nothing changes.
std::string who_pays(const Advice& advice) {
  constexpr double kShare = 0.05;  // of the period: less does not matter to a periodic callback
  constexpr std::size_t kMost = 3;
  if (!advice.compares()) return "";
  std::multimap<double, std::string, std::greater<>> paying;  // by the growth as a share of the period
  bool timers = false;
  for (std::size_t t = 0; t < advice.best->summary.tasks.size(); ++t) {
    const results::TaskSummary &after = advice.best->summary.tasks[t], &before = advice.now->summary.tasks[t];
    timers |= after.kind == TaskKind::timer;
    const double growth = (after.period_range_ms() - before.period_range_ms()) / to_ms(after.period);
    if (growth > kShare)  // not without two jobs
      paying.emplace(growth, concat(after.task, "'s period varies by ", fixed(after.period_range_ms(), 1),
                                    " ms instead of ", fixed(before.period_range_ms(), 1), " ms"));
  }
  if (!timers) return "";
  if (paying.empty()) return "No timer pays for it: no period varies clearly more than today.";
  std::vector<std::string> sentences;
  for (const auto& [growth, sentence] : paying) {
    if (sentences.size() < kMost) sentences.push_back(sentence);
  }
  if (paying.size() > kMost) sentences.push_back(concat("and ", paying.size() - kMost, " more"));
  return concat("Timers pay for it: ", joined(sentences, "; "), ".");
}

/// What the chains get that the objective is not about; empty: there are none, or nothing changes.
std::string other_chains(const Advice& advice) {
  if (!advice.compares()) return "";
  const bool all = advice.objective.kind != Objective::Kind::latency;
  Objective of = latency_beside(advice, advice.objective.latency);
  std::vector<std::string> chains;
  for (of.chain = 0; of.chain < advice.graph.chains.size(); ++of.chain) {
    if (all || of.chain != advice.objective.chain)
      chains.push_back(advice.graph.chains[of.chain].name + " " + gain(advice, of));
  }
  if (chains.empty()) return "";
  return concat(all ? "Chains, " : "Chains beside the objective, ", words_of(of.latency).phrase, " (",
                to_string(of.statistic), "): ", joined(chains, "; "), ".");
}

/// The recommendation and its gain, the other metric, the confidence in it, its cost, other chains, and the
/// timers whose period varies more.
std::vector<std::string> sentences(const Advice& advice) {
  std::vector<std::string> all = {recommendation(advice)};
  if (advice.best == nullptr) return all;
  for (const auto part : {other_metric, confidence, cost, timers_beside, other_chains, who_pays}) {
    if (const std::string sentence = part(advice); !sentence.empty()) all.push_back(sentence);
  }
  const Candidate& c = *advice.best->candidate;
  const auto premises = setup::premises(c.graph, c.tasks.set, c.spec, advice.best->exact());
  all.push_back("It rests on: " + premises.stated + ".");
  all.push_back("It assumes, without a measurement: " + premises.assumed + ".");
  return all;
}

json row_json(const Advice& advice, const Prediction& p) {
  json row = {{"name", name_of(p)},
              {"description", p.candidate->description},
              {"threads", p.candidate->load.threads},
              {"overload", p.overload.value_or("")},
              {"utilisation_percent", p.candidate->load.percent},
              {"warnings", p.candidate->load.warnings},
              {"timer_beside_group", timer_beside_group(*p.candidate)}};
  if (!p.keeps_up()) return row;
  row["objective"] = score(advice.objective, p.summary).value;
  row["lost_percent"] = p.summary.lost_percent();
  row["timers_late"] = std::ranges::count_if(p.summary.tasks, &results::TaskSummary::late);
  row["never_ran"] = p.summary.never_ran();
  row["starved"] = results::starved(p.summary);
  for (const results::ChainSummary& chain : p.summary.chains) {
    for (const auto& [statistic, name] : enum_texts(results::Judged{}))
      for (const Latency of : {Latency::age, Latency::hot_path})
        row["chains_ms"][chain.chain][key_of(statistic, of)] =
            chain.latency(of).quantiles.*traits_of(statistic).of;
  }
  row["cores_used"] = p.cores_used;
  row["bound_ms"] = p.bound ? json(to_ms(Duration(p.bound->ns))) : json();
  row["bound_method"] = p.bound ? p.bound->method : "";
  if (!advice.objective.requirements.empty()) row["proven"] = p.proven;
  if (!p.refusal.empty()) row["bound_refusal"] = p.refusal;
  row["bound_of"] = words_of(advice.objective.latency).bound;
  row["periods_ms"] = json::object();
  for (const results::TaskSummary& t : p.summary.tasks) {
    if (std::isfinite(t.period_range_ms()))
      row["periods_ms"][t.task] = {
          {"period", to_ms(t.period)}, {"least", t.period_ms.min}, {"greatest", t.period_ms.max}};
  }
  if (advice.graph.chains.empty()) return row;
  const results::LatencySummary& l =
      p.summary.chains[advice.objective.chain].latency(advice.objective.latency);
  for (const auto& [statistic, name] : enum_texts(results::Judged{})) {
    const auto [value, interval] = l.estimate(traits_of(statistic).of);
    json& estimate = row[concat(name, "_ms")] = {{"value", value}};
    if (interval) estimate["interval"] = {interval->low, interval->high};
  }
  return row;
}

}  // namespace

std::uint32_t Advice::asked_draws() const {
  const bool random = options.phases == Phases::random ||
                      graph.platform.execution_times != ExecutionTimeModel::worst ||
                      !unknown_deliveries(graph).empty();
  return random ? options.draws : 1;
}

std::uint32_t Advice::draws() const {
  std::size_t most = 0;
  for (const Prediction& p : ranked) most = std::max(most, p.draws.size());
  return static_cast<std::uint32_t>(most);
}

void write_text(std::ostream& out, const Advice& advice, const json& content) {
  const std::vector<std::string> all = content["sentences"];
  out << program::wrapped(all.front()) << "\n";
  if (const Table table = ranking_table(advice, content["ranking"]); !table.rows.empty())
    out << table << "\n";
  write_excluded(out, advice);
  for (const std::string& sentence : std::span(all).subspan(1)) out << "\n" << sentence;
  out << "\n";
  for (const Doubt& doubt : advice.doubts)
    out << "With " << doubt.assumption << ": " << joined(doubt.values) << ".\n";
  if (!advice.causes.empty()) out << "\nIn the first draw:\n" << joined(advice.causes, "\n") << "\n";
  if (advice.change.empty()) return;
  out << "\nChange: " << advice.change << "\n";
  if (!std::filesystem::exists(std::filesystem::path(advice.change).replace_filename("executor.yaml")))
    out << "On ROS 2 (docs/deployments.md): hotpath graph GRAPH --as cie --deployments " << advice.change
        << "\n";
}

void to_json(json& j, const Advice& advice) {
  const std::vector<Chain>& chains = advice.graph.chains;
  j = {{"version", HOTPATH_VERSION},
       {"graph", advice.graph.name},
       {"objective", advice.objective.text},
       {"metric", words_of(advice.objective.latency).phrase},
       {"order", order_of(advice.objective)},
       {"draws", advice.draws()},
       {"asked_draws", advice.asked_draws()},
       {"seconds", advice.options.duration_s},
       {"cores", advice.graph.platform.cores},
       {"now", name_of(*advice.now)},
       {"recommended", advice.best == nullptr ? json() : json(name_of(*advice.best))},
       {"sentences", sentences(advice)},
       {"causes", advice.causes},
       {"change", advice.change},
       {"installation", advice.changes() ? installation(advice.folder, "FOLDER") : ""},
       {"stored", advice.stored},
       {"chain", chains.empty() ? json() : json(chains[advice.objective.chain].name)},
       {"requirements_ms", json::object()},
       {"doubts", json::array()}};
  for (const Objective::Requirement& r : advice.objective.requirements)
    j["requirements_ms"][chains[r.chain].name] = r.most_ms;
  for (const Doubt& d : advice.doubts)
    j["doubts"].push_back({{"assumption", d.assumption}, {"order", d.order}, {"same_first", d.same_first}});
  for (const Prediction& p : advice.ranked) j["ranking"].push_back(row_json(advice, p));
}

}  // namespace hotpath::advise
