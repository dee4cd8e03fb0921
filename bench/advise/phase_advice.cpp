// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <random>

#include "advise/advice_report.hpp"
#include "advise/phase_search.hpp"
#include "guarantees/analyze.hpp"
#include "hotpath/analysis/parallel.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/progress.hpp"
#include "program/table.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"

namespace hotpath::advise {

using nlohmann::json;

static void to_json(json& j, const PhaseValues& values) {
  j = {{"objective", values.score.value},
       {"late_timers", values.score.late_timers},
       {"hot_path_ms", values.hot_path_ms},
       {"age_ms", values.age_ms}};
  if (!values.exact()) j = {{"refusal", *values.refusal}};
}

namespace {

using program::concat, program::fixed;

/// The number of executors, the best before the search, whose phases are searched, and the starts of each.
constexpr std::size_t kSearched = 3, kStarts = 4;
/// The share of the budget for the phases that are compared before the search.
constexpr double kCompareShare = 0.3;
constexpr double kMargin = 0.01;  ///< Unless it is given, in shortest periods.

/// What one candidate guarantees under the phases that are compared, and under those that were found.
struct Compared {
  const Candidate* candidate = nullptr;
  std::vector<PhaseValues> phases = {};   ///< The best first; of random draws only those with values.
  std::optional<PhaseValues> found = {};  ///< Of searched candidates.

  const std::optional<std::string>& refusal() const { return phases.front().refusal; }
  /// Searched ones first.
  std::pair<bool, Score> score() const { return {!found, found.value_or(phases.front()).within_margin}; }
};

void to_json(json& j, const Compared& c) {
  j = {{"name", c.candidate->name},
       {"description", c.candidate->description},
       {"refusal", c.refusal().value_or("")}};
  if (c.refusal()) return;
  j["random"] = json::array();
  for (const PhaseValues& v : c.phases)
    v.rule == Phases::random ? j["random"].push_back(v) : void(j["by_rule"][to_string(v.rule)] = v);
  if (!c.found) return;
  j["chosen"] = *c.found;
  j["within_margin"] = c.found->within_margin.value;
  j["complete"] = c.found->complete;
  const TaskSet& set = c.candidate->tasks.set;
  for (const TaskId id : set.timers()) j["first_release_ms"][set[id].name] = to_ms(c.found->first[id]);
}

class PhaseAdviser : Question {
 public:
  using Question::Question;

  void run() {
    for (const Candidate& c : candidates_) {
      progress_.begin("compared phases, " + c.name);
      share_ += kCompareShare / static_cast<double>(candidates_.size());
      compared_.push_back({&c, compared(c)});
    }
    std::ranges::stable_sort(compared_, {}, &Compared::score);
    search();
    const Compared& best = compared_.front();
    if (!best.found) {
      std::string refusals;
      for (const Compared& c : compared_) refusals += concat("; ", c.candidate->name, ": ", *c.refusal());
      throw program::RunError("advise --phases: nothing is guaranteed" + refusals);
    }
    program::create_folder(folder);
    const std::string file = folder / "phases.csv";
    program::write_whole_file(file, phases_csv(tasks.set, best.found->first));
    std::vector<std::string> files =
        write_executor_files(*best.candidate, graph.platform, "phases.csv", folder);
    files.insert(files.begin(), file);
    prove(best);
    const std::vector<std::string> sentences = sentences_of(best, file);
    const json content = {{"graph", graph.name},
                          {"objective", objective.text},
                          {"margin_ms", to_ms(margin_)},
                          {"now", current(candidates_).name},
                          {"recommended", best.candidate->name},
                          {"sentences", sentences},
                          {"files", files},
                          {"candidates", compared_}};
    std::cout << table(content["candidates"]) << "\n";
    for (const Compared& c : compared_) {
      if (c.refusal()) std::cout << c.candidate->name << " has no exact values: " << *c.refusal() << "\n";
    }
    std::cout << "\n" << program::joined(sentences, "\n") << "\n\nPhases: --phases " << file << "\n";
    program::write_whole_file(folder / "phases.json", content);
    finish(content);
  }

 private:
  Duration margin() const {
    if (!objective.of_worst_cases())
      throw program::UsageError("--for: --phases takes CHAIN:age or CHAIN:worst, CHAIN<MS or worst_lateness");
    const auto period = [](const Task& t) { return t.kind == TaskKind::timer ? t.period : Duration::max(); };
    const Duration shortest = period(*std::ranges::min_element(tasks.set.tasks, {}, period));
    const Duration margin = from_ms(options.margin_ms.value_or(kMargin * to_ms(shortest)));
    if (margin < shortest / 2) return margin;
    throw program::UsageError(
        concat("--margin: ", to_ms(margin), " ms is half of the shortest period or more; give less"));
  }

  /// Whether the steps until now have used up their share of the budget. Shows the progress.
  bool stopped() {
    const Duration elapsed = std::chrono::steady_clock::now() - begin_;
    progress_.update(elapsed, from_s(options.budget_s));
    return program::interrupted() != 0 || elapsed > from_s(share_ * options.budget_s);
  }

  /// The values of the phases that the chosen ones are compared with, the best first.
  std::vector<PhaseValues> compared(const Candidate& c) {
    const auto by = [&](Phases rule, std::uint32_t draw) {
      setup::CommonOptions o = options;
      o.phases = rule;
      PhaseValues values =
          exact_values(c, objective, setup::phases_of_repetition(o, c.graph, c.tasks, c.spec, draw));
      values.rule = rule;
      return values;
    };
    std::vector<PhaseValues> all = {by(Phases::creation, 0), by(Phases::synchronous, 0)};
    const auto is_given = [](const Callback& callback) { return callback.phase || callback.input; };
    if (std::ranges::all_of(tasks.callbacks, is_given)) all.push_back(by(Phases::given, 0));
    std::vector<PhaseValues> draws(std::ranges::none_of(all, &PhaseValues::exact) ? 0 : options.draws);
    for_each_index(draws.size(), options.threads, [&](std::size_t d) {
      if (!stopped()) draws[d] = by(Phases::random, static_cast<std::uint32_t>(d));
    });
    std::ranges::copy_if(draws, std::back_inserter(all), &PhaseValues::exact);
    std::ranges::stable_sort(all, {}, &PhaseValues::score);
    return all;
  }

  /// Searches the candidates with the best compared phases, and the current executor.
  void search() {
    for (std::size_t i = 0; i < compared_.size(); ++i) {
      Compared& c = compared_[i];
      if (c.refusal() || (i >= kSearched && c.candidate->name != options.now)) continue;
      progress_.begin("search, " + c.candidate->name);
      share_ += (1 - kCompareShare) / (kSearched + 1);
      c.found = found(c);
    }
    std::ranges::stable_sort(compared_, {}, &Compared::score);
  }

  PhaseValues found(const Compared& c) {
    std::vector<FirstTimestamps> starts;
    for (const PhaseValues& v : c.phases) {
      if (v.exact() && starts.size() < kStarts) starts.push_back(v.first);
    }
    std::vector<TaskId> sources;
    if (!graph.chains.empty()) sources = index_chains(graph, tasks)[objective.chain].sources;
    const auto evaluate = [&](const FirstTimestamps& first, const Score& enough) {
      PhaseValues values = exact_values(*c.candidate, objective, first);
      std::mt19937_64 random(options.seed);
      for (int end = 0; end < ends_ && values.within_margin <= enough; ++end) {
        FirstTimestamps moved = first;  // later by 0 or twice the margin: only differences of phases matter
        for (const TaskId id : tasks.set.timers())
          if (random() % 2 != 0) moved[id] += 2 * margin_;
        const Score score = exact_values(*c.candidate, objective, moved).score;
        values.within_margin = std::max(values.within_margin, score);
      }
      return values;
    };
    const PhaseValues found =
        search_phases(tasks.set, sources, starts, evaluate, options.threads, [&] { return stopped(); });
    PhaseValues without = c.phases.front();
    without.complete = false;
    return found.exact() ? found : without;
  }

  /// Stores the schedules that reach the objective's worst cases; throws RunError if one does not.
  void prove(const Compared& best) const {
    const Candidate& c = *best.candidate;
    std::vector<bounds::ReachedWorstCase> reached;
    (void)exact_values(c, objective, best.found->first, &reached);
    if (reached.empty()) return;  // interrupted
    const bool of_tasks = objective.kind == Objective::Kind::worst_lateness;
    std::erase_if(reached, [&](const bounds::ReachedWorstCase& w) {
      return (w.latency == Latency::response) != of_tasks || (!of_tasks && w.number != objective.chain);
    });
    GraphTasks proved = c.tasks;
    setup::set_phases(proved.set, best.found->first);
    setup::ExecutorSpec spec = c.spec;
    spec.label = c.executor();
    std::cout << guarantees::write_witnesses(reached, c.graph, proved, spec, options, folder / "witness");
  }

  std::vector<std::string> sentences_of(const Compared& best, const std::string& file) const {
    const auto in_words = [&](const PhaseValues& v) {
      return v.exact() ? fixed(v.score.value, 2) + unit_ : "no exact value";
    };
    std::vector<std::string> sentences = {concat(
        "Take ", best.candidate->name, " with the phases in ", file, ": ", objective.text, " is at most ",
        in_words(*best.found), ", instead of ",
        in_words(*std::ranges::find(best.phases, Phases::creation, &PhaseValues::rule)), " by creation.")};
    if (std::ranges::all_of(tasks.set.tasks, [](const Task& task) { return task.bcet == task.wcet; }))
      sentences.emplace_back(
          "Execution times are constant in this graph and the guarantee (no best_case_execution_time_ms).");
    return sentences;
  }

  /// `candidates`: of phases.json.
  program::Table table(const json& candidates) const {
    program::Table table(
        concat(graph.name, ": guaranteed ", objective.text, " in", unit_, ", by phases (",
               candidates[0]["random"].size(), " random draws)"),
        {"", "creation", "synchro-\nnous", "given", "random\nbest", "random\nmedian", "random\nworst",
         "chosen", "within\nmargin", "hot path\nchosen", "age\nchosen", "late\ntimers"});
    for (const json& c : candidates) {
      if (c["refusal"] != "") continue;
      const bool ended_early = !c.value("complete", true);
      std::vector<program::Value> row = {
          concat(c["name"].get<std::string>(), ended_early ? " (ended early)" : "")};
      const auto add = [&](const std::string& place) {
        const double value = c.value(json::json_pointer(place), kNoValue);
        row.push_back(std::isfinite(value) ? fixed(value, 2) : "");
      };
      for (const char* rule : {"creation", "synchronous", "given"})
        add(concat("/by_rule/", rule, "/objective"));
      const std::size_t draws = c["random"].size();
      for (const std::size_t half : {0, 1, 2})
        draws > 0 ? add(concat("/random/", (draws - 1) * half / 2, "/objective")) : row.push_back("-");
      for (const char* place :
           {"/chosen/objective", "/within_margin", "/chosen/hot_path_ms", "/chosen/age_ms"})
        add(place);
      row.push_back(c.value(json::json_pointer("/chosen/late_timers"), json()));
      table.add_row(row);
    }
    return table;
  }

  const std::string unit_ = objective.kind == Objective::Kind::requirements ? " % of the limit" : " ms";
  const Duration margin_ = margin();
  const int ends_ = margin_ > Duration{} ? 6 : 0;  // choices of offsets at the ends of the margin
  const std::vector<Candidate> candidates_ = candidates_to_compare();
  std::vector<Compared> compared_;  // the best chosen phases first, then unsearched, then refused ones
  program::Progress progress_{candidates_.size() + kSearched + 1, Duration::zero()};
  double share_ = 0;  // of the budget, for the steps until now
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace

void advise_phases(const Options& options) {
  program::catch_interrupts();
  PhaseAdviser(options).run();
}

}  // namespace hotpath::advise
