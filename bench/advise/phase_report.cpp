// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

#include "advise/phase_advice.hpp"
#include "hotpath/reference_system/chain_limits.hpp"
#include "program/interrupt.hpp"
#include "program/text.hpp"
#include "program/text_table.hpp"

namespace hotpath::advise {

namespace {

using nlohmann::json;

std::string ms(double value) {
  return std::isfinite(value) ? program::fixed(value, 2) + " ms" : "no exact value";
}
std::string ms(std::optional<double> value) { return value ? ms(*value) : "no exact value"; }

bool of_requirements(const Objective& objective) { return objective.kind == Objective::Kind::requirements; }

/// The objective's value as a number of the table.
std::string cell(const Objective& objective, const PhaseValues& values) {
  if (!values.refusal.empty()) return "-";
  const double value = of_requirements(objective) ? 100 * values.score.tie : values.score.value;
  return std::isfinite(value) ? program::fixed(value, 2) : "-";
}

std::string in_words(const Objective& objective, const PhaseValues& values) {
  if (!values.refusal.empty()) return "no exact value";
  return of_requirements(objective) ? program::fixed(100 * values.score.tie, 1) + " % of the limit"
                                    : ms(values.score.value);
}

/// The objective as the subject of a sentence.
std::string subject(const Objective& objective) {
  switch (objective.kind) {
    case Objective::Kind::latency:
      return objective.of_hot_path() ? "hot-path latency" : "age";
    case Objective::Kind::requirements:
      return "age";
    default:
      return "lateness of timers";
  }
}

const PhaseValues* of_rule(const PhaseCandidate& c, Phases rule) {
  const auto found = std::ranges::find(c.by_rule, rule, &std::pair<Phases, PhaseValues>::first);
  return found == c.by_rule.end() ? nullptr : &found->second;
}

program::TextTable values_table(const PhaseAdvice& advice) {
  const Objective& o = advice.objective;
  const std::string unit = of_requirements(o) ? "in % of its limit" : "in ms";
  program::TextTable table(program::concat(advice.graph.name, ": guaranteed ", subject(o), " ", unit,
                                           ", by phases (", advice.best->random.size(), " random draws)"),
                           {"", "creation", "synchro-\nnous", "given", "random\nbest", "random\nmedian",
                            "random\nworst", "chosen", "hot path\nchosen", "age\nchosen", "late\ntimers"});
  const auto number = [](const std::optional<double>& value) {
    return value ? program::fixed(*value, 2) : "";
  };
  for (const PhaseCandidate& c : advice.candidates) {
    if (!c.refusal.empty()) continue;
    const PhaseValues* const given = of_rule(c, Phases::given);
    const auto random = [&](std::size_t i) { return c.random.empty() ? "-" : cell(o, c.random[i]); };
    const std::size_t last = c.random.empty() ? 0 : c.random.size() - 1;
    table.add_row({c.candidate->name, cell(o, *of_rule(c, Phases::creation)),
                   cell(o, *of_rule(c, Phases::synchronous)), given != nullptr ? cell(o, *given) : "",
                   random(0), random(last / 2), random(last), c.searched ? cell(o, c.chosen) : "",
                   c.searched ? number(c.chosen.hot_path_ms) : "", c.searched ? number(c.chosen.age_ms) : "",
                   c.searched ? std::to_string(c.chosen.score.late_timers) : ""});
  }
  return table;
}

std::string recommendation(const PhaseAdvice& advice) {
  const Objective& o = advice.objective;
  const PhaseCandidate& best = *advice.best;
  std::string text =
      program::concat("Take ", best.candidate->name, " with the phases in ", advice.files.front(), ": the ",
                      subject(o), " is at most ", in_words(o, best.chosen), ", instead of ",
                      in_words(o, *of_rule(best, Phases::creation)), " by creation, ",
                      in_words(o, *of_rule(best, Phases::synchronous)), " synchronous");
  if (!best.random.empty()) {
    text += program::concat(", and ", in_words(o, best.random.front()), " to ",
                            in_words(o, best.random.back()), " in ", best.random.size(),
                            best.random.size() == 1 ? " random draw" : " random draws");
  }
  if (advice.now == advice.best) return text + ".";
  const std::string& now = advice.now->candidate->name;
  if (!advice.now->refusal.empty())
    return program::concat(text, "; ", now, " has no exact values: ", advice.now->refusal, ".");
  return program::concat(text, "; ", now, " by creation guarantees ",
                         in_words(o, *of_rule(*advice.now, Phases::creation)), ".");
}

std::string both_latencies(const PhaseAdvice& advice) {
  const PhaseValues &chosen = advice.best->chosen, &creation = *of_rule(*advice.best, Phases::creation);
  return program::concat("Of ", advice.graph.chains[advice.objective.chain].name,
                         " it guarantees a hot path of ", ms(chosen.hot_path_ms), " (by creation ",
                         ms(creation.hot_path_ms), ") and an age of ", ms(chosen.age_ms), " (by creation ",
                         ms(creation.age_ms), ").");
}

/// The hot path cannot be shorter than its computation.
std::string limit(const PhaseAdvice& advice) {
  if (!advice.objective.of_hot_path()) return "";
  const double least =
      to_ms(chain_limits(advice.graph, advice.graph.chains[advice.objective.chain]).one_core_per_branch);
  const bool reached = advice.best->chosen.hot_path_ms.value_or(INFINITY) <= least;
  return program::concat(
      "The computation of its longest branch takes ", ms(least),
      reached ? ": no phases guarantee less." : "; no phases can guarantee less than that.");
}

std::string simulated(const PhaseAdvice& advice) {
  const Prediction& p = advice.simulated;
  const bool varies = std::ranges::any_of(advice.best->candidate->tasks.set.tasks,
                                          [](const Task& task) { return task.bcet < task.wcet; });
  std::string text = program::concat("Simulations stay within the guarantee: ", p.draws.size(),
                                     p.draws.size() == 1 ? " draw" : " draws", " of execution times");
  if (!p.summary.chains.empty()) {
    const results::ChainSummary& chain = p.summary.chains[advice.objective.chain];
    text += program::concat(p.draws.size() == 1 ? " has" : " have", " a hot path of ",
                            ms(chain.hot_path.quantiles.p50), " in the median and at most ",
                            ms(chain.hot_path.quantiles.max), ", and an age of at most ",
                            ms(chain.end_to_end.quantiles.max));
  }
  if (varies) return text + ".";
  return text +
         ". Execution times are constant in this graph, and so they are in the guarantee; if they vary, give "
         "the "
         "graph best cases (best_case_execution_time_ms, or execution_time_ms: {min, max}).";
}

std::string sensitivity(const PhaseAdvice& advice) {
  std::string text;
  if (advice.margin > Duration{}) {
    text = program::concat("The search judged phases with offsets that are off by ", to_ms(advice.margin),
                           " ms as well (--margin).");
  }
  for (const PhaseSensitivity& s : advice.sensitivity) {
    text += &s == &advice.sensitivity.front()
                ? program::concat(text.empty() ? "" : " ", "With all offsets off by up to ", to_ms(s.within),
                                  " ms, the worst of ", s.draws.size(), " draws guarantees ")
                : program::concat("; by up to ", to_ms(s.within), " ms, ");
    text += in_words(advice.objective, s.draws.back());
  }
  return advice.sensitivity.empty() ? text : text + ".";
}

/// Names the timers that may miss their deadlines.
std::string late(const PhaseAdvice& advice) {
  std::vector<std::string> names;
  const TaskSet& set = advice.best->candidate->tasks.set;
  for (TaskId id = 0; id < set.size(); ++id) {
    const auto& response = advice.best->chosen.responses[id];
    if (set[id].kind != TaskKind::timer || (response && *response <= set[id].deadline)) continue;
    names.push_back(response ? program::concat(set[id].name, " (", program::fixed(to_ms(*response), 1),
                                               " of ", program::fixed(to_ms(set[id].deadline), 1), " ms)")
                             : set[id].name + " (never runs)");
  }
  if (names.empty()) return "Every timer meets its deadline.";
  return program::concat("These timers may miss their deadlines: ", program::joined(names), ".");
}

json values_json(const PhaseValues& values) {
  if (!values.refusal.empty()) return {{"refusal", values.refusal}};
  const auto number = [](const std::optional<double>& v) {
    return v && std::isfinite(*v) ? json(*v) : json();
  };
  return {{"objective", number(values.score.value)},
          {"late_timers", values.score.late_timers},
          {"hot_path_ms", number(values.hot_path_ms)},
          {"age_ms", number(values.age_ms)}};
}

json values_json(const std::vector<PhaseValues>& all) {
  json list = json::array();
  for (const PhaseValues& values : all) list.push_back(values_json(values));
  return list;
}

json candidate_json(const PhaseCandidate& c) {
  json j = {{"name", c.candidate->name}, {"description", c.candidate->description}, {"refusal", c.refusal}};
  if (!c.refusal.empty()) return j;
  for (const auto& [rule, values] : c.by_rule)
    j["by_rule"][std::string(to_string(rule))] = values_json(values);
  j["random"] = values_json(c.random);
  if (!c.searched) return j;
  j["chosen"] = values_json(c.chosen);
  j["within_margin"] = std::isfinite(c.found.score.value) ? json(c.found.score.value) : json();
  j["evaluations"] = c.found.evaluations;
  j["complete"] = c.found.complete;
  const TaskSet& set = c.candidate->tasks.set;
  for (TaskId id = 0; id < set.size(); ++id) {
    if (set[id].kind == TaskKind::timer) j["first_release_ms"][set[id].name] = to_ms(c.found.first[id]);
  }
  return j;
}

}  // namespace

std::vector<std::string> phase_sentences(const PhaseAdvice& advice) {
  std::vector<std::string> all = {recommendation(advice)};
  if (!advice.graph.chains.empty()) all.push_back(both_latencies(advice));
  for (std::string sentence : {limit(advice), simulated(advice), sensitivity(advice), late(advice)}) {
    if (!sentence.empty()) all.push_back(std::move(sentence));
  }
  std::vector<std::string> early;
  for (const PhaseCandidate& c : advice.candidates) {
    if (c.searched && !c.found.complete) {
      early.push_back(program::concat(c.candidate->name, " after ", c.found.evaluations, " choices"));
    }
  }
  if (!early.empty()) {
    all.push_back(program::concat(
        "The search ", program::interrupted() != 0 ? "was interrupted" : "ended early (--budget SECONDS)",
        ": ", program::joined(early), ". These phases are the best so far."));
  }
  return all;
}

void write_phase_advice(std::ostream& out, const PhaseAdvice& advice) {
  out << values_table(advice) << "\n";
  for (const PhaseCandidate& c : advice.candidates) {
    if (!c.refusal.empty()) out << c.candidate->name << " has no exact values: " << c.refusal << "\n";
  }
  out << "\n";
  for (const std::string& sentence : phase_sentences(advice)) out << sentence << "\n";
  out << "\nPhases: --phases-file " << advice.files.front()
      << " of `hotpath simulate`, `run`, `compare` and `analyze`\n";
}

json phase_advice_json(const PhaseAdvice& advice) {
  json all = {{"graph", advice.graph.name},
              {"objective", advice.objective.text},
              {"margin_ms", to_ms(advice.margin)},
              {"now", advice.now->candidate->name},
              {"recommended", advice.best->candidate->name},
              {"sentences", phase_sentences(advice)},
              {"files", advice.files}};
  for (const PhaseCandidate& c : advice.candidates) all["candidates"].push_back(candidate_json(c));
  all["sensitivity"] = json::array();
  for (const PhaseSensitivity& s : advice.sensitivity) {
    all["sensitivity"].push_back({{"within_ms", to_ms(s.within)}, {"draws", values_json(s.draws)}});
  }
  const Prediction& p = advice.simulated;
  all["simulated"] = {{"draws", p.draws.size()}};
  if (!p.summary.chains.empty()) {
    const results::ChainSummary& chain = p.summary.chains[advice.objective.chain];
    all["simulated"]["hot_path_latency_ms"] = chain.hot_path.quantiles;
    all["simulated"]["end_to_end_latency_ms"] = chain.end_to_end.quantiles;
  }
  return all;
}

}  // namespace hotpath::advise
