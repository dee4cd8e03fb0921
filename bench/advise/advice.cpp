// SPDX-License-Identifier: Apache-2.0
#include "advise/advice.hpp"

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <thread>

#include "advise/advice_files.hpp"
#include "advise/advice_report.hpp"
#include "explain/explain.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/progress.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"

namespace hotpath::advise {

namespace {

using program::concat;

/// Number of best candidates in the doubts, in addition to the current executor.
constexpr std::size_t kDoubted = 3;
/// The ranking's share of the budget; the rest is for the doubts.
constexpr double kRankingShare = 0.6;

/// Rejects a graph that does not fit into memory: every candidate has a graph and tasks, and every
/// candidate under simulation has a trace.
void check_memory(const Question& q) {
  constexpr double kCandidates = 30, kBytesOfTask = 2500;  // measured with 1000 to 20,000 nodes
  const std::size_t at_once =
      q.options.threads > 0 ? q.options.threads : std::max(1U, std::thread::hardware_concurrency());
  setup::check_trace_memory(q.options, q.tasks, at_once, kCandidates * kBytesOfTask * q.tasks.set.size(),
                            "a shorter --duration, fewer --threads, or a part of the graph");
}

/// One draw suffices if nothing is random.
std::uint32_t draws_of(const Question& q) {
  const bool random = q.options.phases == Phases::random ||
                      q.graph.platform.execution_times != ExecutionTimeModel::worst ||
                      !unknown_deliveries(q.graph).empty();
  return random ? q.options.draws : 1;
}

std::vector<Prediction> predicted(const Question& q, const std::string& title,
                                  const std::vector<Candidate>& candidates, double share) {
  Options options = q.options;
  options.draws = draws_of(q);
  options.budget_s *= share;
  const Duration budget = setup::seconds(options.budget_s);
  program::Progress progress(1, budget);
  progress.begin(title);
  const auto begin = std::chrono::steady_clock::now();
  return predict(candidates, options,
                 [&](std::uint32_t) { progress.update(std::chrono::steady_clock::now() - begin, budget); });
}

/// What the ranking assumes, changed in one way.
struct Assumption {
  std::string text;
  std::function<Graph(Graph)> change;
};

/// The order of creation, or its reverse, wherever the order of delivery is unknown.
Graph delivered(Graph graph, bool reversed) {
  for (const std::string& topic : unknown_deliveries(graph)) {
    std::vector<std::string>& nodes = graph.delivery[topic].nodes = subscribers_of(graph, topic);
    if (reversed) std::ranges::reverse(nodes);
  }
  return graph;
}

std::vector<Assumption> assumptions(const Graph& graph) {
  std::vector<Assumption> all = {{"execution times 20 % longer",
                                  [](Graph g) {
                                    constexpr double kLonger = 1.2;
                                    if (load_percent(g) > 0) scale_to_load(g, kLonger * load_percent(g));
                                    return g;
                                  }},
                                 {"one more core", [](Graph g) {
                                    ++g.platform.cores;
                                    return g;
                                  }}};
  const std::size_t unknown = unknown_deliveries(graph).size();
  if (unknown == 0) return all;
  const std::string topics =
      concat(unknown, unknown == 1 ? " topic" : " topics", " of unknown delivery in the ");
  all.push_back({topics + "order of creation", [](Graph g) { return delivered(std::move(g), false); }});
  all.push_back({topics + "reverse order", [](Graph g) { return delivered(std::move(g), true); }});
  return all;
}

Doubt doubted(const Advice& advice, const std::string& assumption,
              const std::vector<Prediction>& predictions) {
  Doubt doubt{.assumption = assumption, .order = {}, .values = {}};
  for (const Prediction* p : ranked(predictions, advice.objective)) {
    const std::string& name = p->candidate->name;
    doubt.order.push_back(name);
    doubt.values.push_back(name +
                           (p->keeps_up() ? " " + value_text(advice.objective, *p) : " cannot keep up"));
  }
  // Candidates that cannot be recommended may have been ahead before.
  const auto ahead_before = [&](const std::string& name) {
    return std::ranges::any_of(advice.ranked.begin(), std::ranges::find(advice.ranked, advice.best),
                               [&](const Prediction* p) { return p->candidate->name == name; });
  };
  const auto best = std::ranges::find(doubt.order, advice.best->candidate->name);
  doubt.same_first = std::all_of(doubt.order.begin(), best, ahead_before);
  return doubt;
}

/// The rankings of the best candidates under changed assumptions.
std::vector<Doubt> doubts(const Question& q, const Advice& advice) {
  std::vector<const Candidate*> kept;
  for (const Prediction* p : advice.ranked) {
    const bool one_of_best = kept.size() < kDoubted && p->keeps_up();
    if (one_of_best || p == advice.best || p == &advice.now) kept.push_back(p->candidate);
  }
  const std::vector<Assumption> changed = assumptions(q.graph);
  const double share = (1 - kRankingShare) / static_cast<double>(changed.size());
  std::vector<Doubt> all;
  for (const Assumption& assumption : changed) {
    std::vector<Candidate> candidates;
    candidates.reserve(kept.size());
    for (const Candidate* c : kept) candidates.push_back(with_graph(*c, assumption.change(c->graph)));
    all.push_back(doubted(advice, assumption.text, predicted(q, assumption.text, candidates, share)));
  }
  return all;
}

/// Why the recommended executor is faster than the current one in the first draw.
std::vector<std::string> causes_of_gain(const Question& q, const Advice& advice) {
  if (!advice.changes() || !advice.now.keeps_up() || q.graph.chains.empty()) return {};
  const Candidate &a = *advice.now.candidate, &b = *advice.best->candidate;
  const SimulatedDraw of_a = simulate_draw(a, q.options, 0), of_b = simulate_draw(b, q.options, 0);
  const auto run = [](const Candidate& c, const SimulatedDraw& d) {
    return explain::SimulatedRun{c.name, c.spec, c.graph, d.tasks, *d.times, d.repetition.trace};
  };
  return explain::difference(run(a, of_a), run(b, of_b), static_cast<std::uint32_t>(q.objective.chain),
                             !q.objective.age);
}

/// The advice without files. `predictions` must outlive it.
Advice advice_of(const Question& q, const std::vector<Prediction>& predictions, const Candidate& now) {
  Advice advice{q.graph, q.objective, ranked(predictions, q.objective),
                *std::ranges::find(predictions, &now, &Prediction::candidate)};
  advice.best = recommended(advice.ranked, advice.now, q.objective);
  for (const Prediction& p : predictions)
    advice.draws = std::max(advice.draws, static_cast<std::uint32_t>(p.draws.size()));
  advice.asked_draws = draws_of(q);
  advice.seconds = q.options.duration_s;
  if (advice.best != nullptr && program::interrupted() == 0) advice.doubts = doubts(q, advice);
  if (program::interrupted() == 0) advice.causes = causes_of_gain(q, advice);
  return advice;
}

/// Writes the contract of the recommended executor, and returns its file; empty: none is recommended.
std::string write_contract(const Question& q, const Advice& advice) {
  if (advice.best == nullptr || !q.options.contract) return "";
  const Candidate& c = *advice.best->candidate;
  Graph stated = c.graph;
  stated.platform = q.graph.platform;
  const std::filesystem::path file = q.folder / "contract.yaml";
  program::write_whole_file(file, q.options.contract(stated, c.tasks, c.spec));
  return file.string();
}

void write(const Question& q, Advice advice) {
  program::create_folder(q.folder);
  if (advice.changes()) advice.change = write_change(*advice.best->candidate, q.graph, q.folder);
  const std::string contract = write_contract(q, advice);
  if (!advice.causes.empty() && can_be_written(*advice.now.candidate)) {
    advice.stored = {store_first_draw(*advice.now.candidate, q.options, q.folder / "now"),
                     store_first_draw(*advice.best->candidate, q.options, q.folder / "recommended")};
  }
  const bool chains = !q.graph.chains.empty();
  if (chains) write_latencies(q.folder / "latencies.csv", advice.ranked, q.objective.chain);
  const nlohmann::json content = advice;
  program::write_whole_file(q.folder / "advice.json", content);
  write_text(std::cout, advice);
  if (advice.draws > 0 && advice.draws < advice.asked_draws) {
    std::cout << "Only " << advice.draws << " of " << advice.asked_draws << " draws: "
              << (program::interrupted() != 0 ? "interrupted" : "the budget ended (--time-out SECONDS)")
              << ".\n";
  }
  const auto has_outputs = [&](const Prediction* p) {
    return chains && p->keeps_up() && p->summary.chains[q.objective.chain].hot_path.quantiles.n > 0;
  };
  if (std::ranges::any_of(advice.ranked, has_outputs)) program::draw_figure("advice", q.folder);
  if (!contract.empty()) std::cout << "\nContract for `hotpath watch`: " << contract << "\n";
  if (advice.changes()) std::cout << installation(q.folder);
  q.finish(content);
}

}  // namespace

void advise(const Options& options) {
  program::catch_interrupts();
  if (!options.phases_of.empty()) {
    throw program::UsageError("--phases " + options.phases_of +
                              ": draws take the phases of a CSV file, not of a run");
  }
  const Question question(options, Objective::Statistic::p99);
  check_memory(question);
  const std::vector<Candidate> candidates = question.candidates(true);
  std::vector<Prediction> predictions = predicted(question, "ranking", candidates, kRankingShare);
  for (Prediction& p : predictions) {
    if (p.keeps_up()) add_bound(p, question.objective);
  }
  write(question, advice_of(question, predictions, question.now(candidates)));
}

}  // namespace hotpath::advise
