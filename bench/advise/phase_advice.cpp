// SPDX-License-Identifier: Apache-2.0
#include "advise/phase_advice.hpp"

#include <algorithm>
#include <array>
#include <iostream>
#include <limits>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>

#include "advise/advised_graph.hpp"
#include "advise/executor_file.hpp"
#include "guarantees/witnesses.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_writer.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/parallel.hpp"
#include "program/progress.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"

namespace hotpath::advise {

namespace {

namespace fs = std::filesystem;

/// The number of executors, the best before the search, whose phases are searched.
constexpr std::size_t kSearched = 3;
/// Starts of a search, the best of the compared phases.
constexpr std::size_t kStarts = 4;
/// The search's share of the budget; the rest is for simulations and perturbed phases.
constexpr double kSearchShare = 0.75;
/// The share for the phases that are compared before the search.
constexpr double kCompareShare = 0.3;
/// The margin, unless it is given: a share of the shortest period.
constexpr double kMargin = 0.01;
/// Choices of offsets at both ends of the margin, in addition to the exact ones, that the search tries.
constexpr std::size_t kEnds = 6;
/// The sensitivity: the number of draws, and how far offsets are off, in margins.
constexpr std::size_t kPerturbations = 16;
constexpr std::array kMargins = {0.2, 1.0, 4.0};

class PhaseAdviser {
 public:
  explicit PhaseAdviser(const Options& options)
      : options_(options),
        graph_(advised_graph(options)),
        objective_(advised_objective(options, graph_, "hot_path:worst")),
        folder_(setup::output_folder(options, graph_)) {
    check_guaranteed(objective_, graph_);
    check_load(graph_, make_tasks(graph_));
    double shortest_ms = std::numeric_limits<double>::infinity();
    for (const Task& task : make_tasks(graph_).set.tasks) {
      if (task.kind == TaskKind::timer) shortest_ms = std::min(shortest_ms, to_ms(task.period));
    }
    usual_margin_ = from_ms(kMargin * shortest_ms);
    margin_ = options.margin_ms ? from_ms(*options.margin_ms) : usual_margin_;
    if (2 * margin_ >= from_ms(shortest_ms)) {
      throw program::UsageError(program::concat("--margin: ", to_ms(margin_),
                                                " ms is half of the shortest period or more; give less"));
    }
  }

  void run() {
    program::check_output_folder(folder_);
    const std::vector<Candidate> candidates =
        make_candidates(graph_, objective_, candidate_options(options_, graph_, "graph"));
    PhaseAdvice advice{graph_, objective_, {}, nullptr, nullptr, margin_, {}, {}, {}};
    compare(candidates, advice);
    search(advice);
    choose(advice, candidates);
    if (advice.best == nullptr)
      throw program::RunError(program::concat("advise --phases: nothing is guaranteed; ", refusals(advice)));
    program::create_folder(folder_);
    store(advice);
    prove(*advice.best);
    simulate(advice);
    perturb(advice);
    const nlohmann::json content = phase_advice_json(advice);
    program::write_whole_file(folder_ / "phases.json", content);
    write_phase_advice(std::cout, advice);
    std::cout << "\nResults: " << folder_.string() << "\n" << std::flush;
    program::show_json(content);
  }

 private:
  bool stopped(double share) const {
    return program::interrupted() != 0 ||
           std::chrono::steady_clock::now() - begin_ > setup::seconds(share * options_.budget_s);
  }

  void show(program::Progress& progress) const {
    progress.update(std::chrono::steady_clock::now() - begin_, setup::seconds(options_.budget_s));
  }

  FirstTimestamps phases(const Candidate& candidate, Phases rule, std::uint32_t draw) const {
    setup::CommonOptions o = options_;
    o.phases = rule;
    return setup::phases_of_repetition(o, candidate.graph, candidate.tasks, candidate.spec, draw);
  }

  /// Evaluates the phases that the chosen ones are compared with.
  void compare(const std::vector<Candidate>& candidates, PhaseAdvice& advice) {
    std::vector<Phases> rules = {Phases::creation, Phases::synchronous};
    if (std::ranges::all_of(candidates.front().tasks.set.tasks, [&, id = TaskId{0}](const Task& t) mutable {
          const bool known = candidates.front().tasks.callbacks[id++].phase.has_value();
          return known || t.kind != TaskKind::timer;
        })) {
      rules.push_back(Phases::given);
    }
    program::Progress progress(candidates.size(), Duration::zero());
    for (const Candidate& candidate : candidates) {
      progress.begin("compared phases, " + candidate.name);
      show(progress);
      PhaseCandidate& c = advice.candidates.emplace_back();
      c.candidate = &candidate;
      const PhaseEvaluator evaluator(candidate, objective_);
      for (const Phases rule : rules) c.by_rule.emplace_back(rule, evaluator.at(phases(candidate, rule, 0)));
      if (std::ranges::all_of(c.by_rule, [](const auto& v) { return !v.second.refusal.empty(); })) {
        c.refusal = c.by_rule.front().second.refusal;
        continue;
      }
      const double share = kCompareShare * static_cast<double>(advice.candidates.size()) /
                           static_cast<double>(candidates.size());
      std::vector<PhaseValues> draws(options_.draws);
      program::for_each_index(draws.size(), options_.threads, [&](std::size_t d) {
        draws[d].refusal = "the budget ended";
        if (!stopped(share))
          draws[d] = evaluator.at(phases(candidate, Phases::random, static_cast<std::uint32_t>(d)));
      });
      std::vector<FirstTimestamps>& starts = starts_[&candidate];
      std::vector<std::pair<PhaseScore, FirstTimestamps>> all;
      for (const auto& [rule, values] : c.by_rule) {
        if (values.refusal.empty()) all.emplace_back(values.score, phases(candidate, rule, 0));
      }
      for (std::size_t d = 0; d < draws.size(); ++d) {
        if (!draws[d].refusal.empty()) continue;
        all.emplace_back(draws[d].score, phases(candidate, Phases::random, static_cast<std::uint32_t>(d)));
        c.random.push_back(std::move(draws[d]));
      }
      sort_by_score(c.random);
      std::ranges::stable_sort(all, [](const auto& a, const auto& b) { return a.first < b.first; });
      for (auto& [score, first] : all) {
        if (starts.size() < kStarts) starts.push_back(std::move(first));
      }
      best_start_[&candidate] = all.front().first;
    }
  }

  static void sort_by_score(std::vector<PhaseValues>& values) {
    std::ranges::stable_sort(values, [](const auto& a, const auto& b) { return a.score < b.score; });
  }

  /// Searches the candidates with the best starts, and the current executor.
  void search(PhaseAdvice& advice) {
    std::ranges::stable_sort(advice.candidates, [&](const PhaseCandidate& a, const PhaseCandidate& b) {
      if (!a.refusal.empty() || !b.refusal.empty()) return a.refusal.empty() && !b.refusal.empty();
      return best_start_.at(a.candidate) < best_start_.at(b.candidate);
    });
    std::vector<PhaseCandidate*> searched;
    for (PhaseCandidate& c : advice.candidates) {
      const bool among_best = searched.size() < kSearched || c.candidate->name == options_.now;
      if (c.refusal.empty() && among_best) searched.push_back(&c);
    }
    program::Progress progress(searched.size(), Duration::zero());
    for (std::size_t i = 0; i < searched.size(); ++i) {
      PhaseCandidate& c = *searched[i];
      progress.begin("search, " + c.candidate->name);
      const PhaseEvaluator evaluator(*c.candidate, objective_);
      const double share = kCompareShare + (kSearchShare - kCompareShare) * static_cast<double>(i + 1) /
                                               static_cast<double>(searched.size());
      PhaseSearchOptions o;
      o.threads = options_.threads;
      o.stop = [&] {
        show(progress);
        return stopped(share);
      };
      std::mutex mutex;
      std::map<FirstTimestamps, PhaseValues> known;  // an interruption ends later evaluations
      const auto score = [&](const FirstTimestamps& first, const PhaseScore& enough) {
        PhaseValues values = evaluator.at(first);
        PhaseScore worst = values.score;
        {
          const std::lock_guard lock(mutex);
          known[first] = std::move(values);
        }
        std::mt19937_64 random(options_.seed);
        for (std::size_t end = 0; margin_ > Duration{} && end < kEnds && worst <= enough; ++end) {
          const auto either = [&] { return random() % 2 == 0 ? Duration{} : 2 * margin_; };
          const PhaseScore moved = evaluator.at(moved_by(first, c.candidate->tasks.set, either)).score;
          if (moved > worst) worst = moved;
        }
        return worst;
      };
      c.found =
          search_phases(c.candidate->tasks.set, sources(*c.candidate), starts_.at(c.candidate), score, o);
      c.chosen = known[c.found.first];
      take_best(c);
      c.searched = true;
    }
  }

  /// A search that ended before its first evaluation has found nothing.
  void take_best(PhaseCandidate& c) const {
    if (c.chosen.refusal.empty() && !c.chosen.responses.empty()) return;
    c.found.first = starts_.at(c.candidate).front();
    c.found.score = best_start_.at(c.candidate);
    for (const auto& [rule, values] : c.by_rule) {
      if (values.refusal.empty() && values.score == c.found.score) c.chosen = values;
    }
    if (!c.random.empty() && c.random.front().score == c.found.score) c.chosen = c.random.front();
  }

  std::vector<TaskId> sources(const Candidate& candidate) const {
    if (candidate.graph.chains.empty()) return {};
    return index_chains(candidate.graph, candidate.tasks)[objective_.chain].sources;
  }

  void choose(PhaseAdvice& advice, const std::vector<Candidate>& candidates) const {
    std::ranges::stable_sort(advice.candidates, [](const PhaseCandidate& a, const PhaseCandidate& b) {
      if (!a.searched || !b.searched) return a.searched && !b.searched;
      return a.found.score < b.found.score;
    });
    if (!advice.candidates.empty() && advice.candidates.front().searched)
      advice.best = &advice.candidates.front();
    // A deployment from a file has the name in the file, and is the last candidate.
    const auto named = std::ranges::find(candidates, options_.now, &Candidate::name);
    const Candidate* now = named == candidates.end() ? &candidates.back() : &*named;
    advice.now = &*std::ranges::find(advice.candidates, now, &PhaseCandidate::candidate);
  }

  static std::string refusals(const PhaseAdvice& advice) {
    std::string text;
    for (const PhaseCandidate& c : advice.candidates) {
      if (!text.empty()) text += "; ";
      text += program::concat(c.candidate->name, ": ", c.refusal);
    }
    return text;
  }

  void store(PhaseAdvice& advice) const {
    const Candidate& c = *advice.best->candidate;
    const fs::path phases = folder_ / "phases.csv";
    program::write_whole_file(phases, phases_csv(c.tasks.set, advice.best->found.first));
    advice.files.push_back(phases.string());
    const std::vector<std::string> files = write_executor_files(c, graph_.platform, "phases.csv", folder_);
    advice.files.insert(advice.files.end(), files.begin(), files.end());
    if (!c.sets_priorities || !files.empty()) return;
    Graph graph = c.graph;
    graph.platform = graph_.platform;
    const fs::path file = folder_ / "graph.yaml";
    write_graph(file, graph, {"With the priorities of the advice.", {}}, program::write_with_folder);
    advice.files.push_back(file.string());
  }

  /// Stores the schedules that reach the objective's worst cases; throws RunError if one does not.
  void prove(const PhaseCandidate& best) const {
    const Candidate& c = *best.candidate;
    std::vector<bounds::ReachedWorstCase> reached;
    const PhaseValues values = PhaseEvaluator(c, objective_).at(best.found.first, &reached);
    if (program::interrupted() != 0) return;
    const bool of_tasks = objective_.kind == Objective::Kind::worst_lateness;
    std::erase_if(reached, [&](const bounds::ReachedWorstCase& w) {
      return of_tasks ? w.kind != "task" : w.kind == "task" || w.number != objective_.chain;
    });
    GraphTasks tasks = c.tasks;
    setup::set_phases(tasks.set, best.found.first);
    setup::ExecutorSpec spec = c.spec;
    if (c.sets_priorities) spec.label = spec.entry->name;  // the label is that of the candidate
    std::cout << guarantees::write_witnesses(reached, c.graph, tasks, spec, options_, folder_ / "witness");
  }

  /// Simulates the file of phases; throws RunError if a guarantee is exceeded.
  void simulate(PhaseAdvice& advice) {
    const PhaseCandidate& best = *advice.best;
    simulated_.push_back(*best.candidate);
    GraphPlatform& platform = simulated_.front().graph.platform;
    const bool varies = std::ranges::any_of(simulated_.front().tasks.set.tasks,
                                            [](const Task& task) { return task.bcet < task.wcet; });
    if (platform.execution_times == ExecutionTimeModel::worst && varies) {
      platform.execution_times = ExecutionTimeModel::uniform;
    }
    PredictionOptions o;
    o.common = options_;
    o.common.phases_file = folder_ / "phases.csv";
    o.common.phases = Phases::given;
    o.draws = varies ? options_.draws : 1;
    o.budget = setup::seconds((1 - kSearchShare) / 2 * options_.budget_s);
    o.threads = options_.threads;
    advice.simulated = std::move(predict(simulated_, o, [](std::uint32_t) {}).front());
    const Prediction& p = advice.simulated;
    if (!p.overload.empty())
      throw program::RunError("the simulation of the chosen phases cannot keep up: " + p.overload);
    const auto check = [&](const std::string& value, double simulated, double guaranteed) {
      if (!(simulated > guaranteed + 1e-9)) return;
      throw program::RunError(program::concat("a guarantee is wrong: the simulated ", value, " of ",
                                              simulated, " ms exceeds ", guaranteed, " ms. Please report ",
                                              folder_ / "phases.csv", " and the graph"));
    };
    if (!p.summary.chains.empty()) {
      const results::ChainSummary& chain = p.summary.chains[objective_.chain];
      check("hot path", chain.hot_path.quantiles.max, best.chosen.hot_path_ms.value_or(0));
      check("age", chain.end_to_end.quantiles.max, best.chosen.age_ms.value_or(0));
    }
    for (TaskId id = 0; id < p.summary.tasks.size(); ++id) {
      if (p.summary.tasks[id].kind != TaskKind::timer || !best.chosen.responses[id]) continue;
      check(p.summary.tasks[id].task, p.summary.tasks[id].response_ms.max, to_ms(*best.chosen.responses[id]));
    }
  }

  /// Each timer later by a time from 0 to twice the largest error of an offset: only differences of phases
  /// matter, and no phase is negative.
  static FirstTimestamps moved_by(FirstTimestamps first, const TaskSet& set, const auto& time) {
    for (TaskId id = 0; id < set.size(); ++id) {
      if (set[id].kind == TaskKind::timer) first[id] += time();
    }
    return first;
  }

  void perturb(PhaseAdvice& advice) const {
    const PhaseCandidate& best = *advice.best;
    const PhaseEvaluator evaluator(*best.candidate, objective_);
    for (const double margins : kMargins) {
      if (stopped(1)) return;
      const Duration unit = margin_ > Duration{} ? margin_ : usual_margin_;
      PhaseSensitivity sensitivity{from_ms(margins * to_ms(unit)), {}};
      std::mt19937_64 random(options_.seed + 1);  // not the choices of the search
      const auto width = static_cast<std::uint64_t>(2 * sensitivity.within.count() + 1);
      std::vector<FirstTimestamps> all;
      for (std::size_t d = 0; d < kPerturbations; ++d) {
        all.push_back(moved_by(best.found.first, best.candidate->tasks.set,
                               [&] { return Duration(random() % width); }));
      }
      sensitivity.draws.resize(all.size());
      program::for_each_index(all.size(), options_.threads,
                              [&](std::size_t d) { sensitivity.draws[d] = evaluator.at(all[d]); });
      if (program::interrupted() != 0) return;
      std::erase_if(sensitivity.draws, [](const PhaseValues& v) { return !v.refusal.empty(); });
      sort_by_score(sensitivity.draws);
      if (!sensitivity.draws.empty()) advice.sensitivity.push_back(std::move(sensitivity));
    }
  }

  Options options_;
  const Graph graph_;
  const Objective objective_;
  const fs::path folder_;
  Duration usual_margin_{}, margin_{};
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::map<const Candidate*, std::vector<FirstTimestamps>> starts_;
  std::map<const Candidate*, PhaseScore> best_start_;
  std::vector<Candidate> simulated_;  // which the prediction refers to
};

}  // namespace

void advise_phases(const Options& options) {
  program::catch_interrupts();
  PhaseAdviser(options).run();
}

}  // namespace hotpath::advise
