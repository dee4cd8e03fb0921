// SPDX-License-Identifier: Apache-2.0
#include "advise/advice.hpp"

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <thread>

#include "advise/advice_report.hpp"
#include "advise/advised_graph.hpp"
#include "advise/executor_file.hpp"
#include "advise/ranking.hpp"
#include "advise/stored_draw.hpp"
#include "explain/simulated_difference.hpp"
#include "hotpath/reference_system/graph_writer.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/progress.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"

namespace hotpath::advise {

namespace {

namespace fs = std::filesystem;

/// Number of best candidates in the doubts, in addition to the current executor.
constexpr std::size_t kDoubted = 3;
/// The ranking's share of the budget; the rest is for the doubts.
constexpr double kRankingShare = 0.6;

/// Rejects a graph that does not fit into memory: every candidate has a graph and tasks, and every
/// candidate under simulation has a trace.
void check_memory(const Options& options, const GraphTasks& tasks) {
  constexpr double kCandidates = 30, kBytesOfTask = 2500;  // measured with 1000 to 20,000 nodes
  const std::size_t at_once =
      options.threads > 0 ? options.threads : std::max(1U, std::thread::hardware_concurrency());
  setup::check_trace_memory(options, tasks, at_once, kCandidates * kBytesOfTask * tasks.set.size(),
                            "a shorter --duration, fewer --threads, or a part of the graph");
}

class Adviser {
 public:
  explicit Adviser(const Options& options)
      : options_(options),
        graph_(advised_graph(options)),
        objective_(advised_objective(options, graph_, "hot_path:p99")),
        candidate_options_(candidate_options(options, graph_, "reference")) {
    if (!options_.phases_file.empty()) options_.phases = Phases::given;
    if (!options_.phases_of.empty())
      throw program::UsageError("--phases " + options_.phases_of +
                                ": draws take the phases of a CSV file, not of a run");
    const GraphTasks tasks = make_tasks(graph_);
    check_load(graph_, tasks);
    check_memory(options_, tasks);
  }

  void run() {
    program::check_output_folder(setup::output_folder(options_, graph_));
    const std::vector<Candidate> candidates = make_candidates(graph_, objective_, candidate_options_);
    Advice advice{graph_, objective_, {}, nullptr, nullptr, 0, 0, 0, {}, {}, {}, {}};
    std::vector<Prediction> predictions = predicted("ranking", candidates, kRankingShare * options_.budget_s);
    for (Prediction& p : predictions) {
      if (p.overload.empty()) add_bound(p, objective_);
    }
    advice.ranked = ranked(predictions, objective_);
    advice.now = &*std::ranges::find_if(
        predictions, [&](const Prediction& p) { return p.candidate->name == now_name(candidates); });
    advice.best = recommended(advice.ranked, *advice.now, objective_);
    for (const Prediction& p : predictions) {
      advice.draws = std::max(advice.draws, static_cast<std::uint32_t>(p.draws.size()));
    }
    advice.asked_draws = draws();
    advice.seconds = options_.duration_s;
    if (advice.best != nullptr && program::interrupted() == 0) doubt(advice);
    if (program::interrupted() == 0) explain_gain(advice);
    write(advice);
  }

 private:
  /// A deployment from a file has the name in the file, and is the last candidate.
  std::string now_name(const std::vector<Candidate>& candidates) const {
    const auto now = std::ranges::find(candidates, options_.now, &Candidate::name);
    return now == candidates.end() ? candidates.back().name : now->name;
  }

  /// One draw suffices if nothing is random.
  std::uint32_t draws() const {
    const bool random = options_.phases == Phases::random ||
                        graph_.platform.execution_times != ExecutionTimeModel::worst ||
                        !unknown_deliveries(graph_).empty();
    return random ? options_.draws : 1;
  }

  std::vector<Prediction> predicted(const std::string& title, const std::vector<Candidate>& candidates,
                                    double budget_s) const {
    PredictionOptions o;
    o.common = options_;
    o.draws = draws();
    o.budget = setup::seconds(budget_s);
    o.threads = options_.threads;
    program::Progress progress(1, o.budget);
    progress.begin(title);
    const auto begin = std::chrono::steady_clock::now();
    return predict(candidates, o, [&](std::uint32_t) {
      progress.update(std::chrono::steady_clock::now() - begin, o.budget);
    });
  }

  void doubt(Advice& advice) const {
    std::vector<Candidate> kept;
    for (const Prediction* p : advice.ranked) {
      const bool one_of_best = kept.size() < kDoubted && p->overload.empty();
      if (one_of_best || p == advice.best || p == advice.now) kept.push_back(*p->candidate);
    }
    constexpr double kLonger = 1.2;
    std::vector<Candidate> longer = kept, more_cores = kept;
    for (Candidate& c : longer) {
      if (load_percent(c.graph) > 0) scale_to_load(c.graph, kLonger * load_percent(c.graph));
      weigh(c);
    }
    for (Candidate& c : more_cores) {
      ++c.graph.platform.cores;
      weigh(c);
    }
    std::vector<std::pair<std::string, std::vector<Candidate>>> doubts = {
        {"execution times 20 % longer", std::move(longer)}, {"one more core", std::move(more_cores)}};
    if (const std::size_t unknown = unknown_deliveries(graph_).size(); unknown > 0) {
      const std::string topics =
          program::concat(unknown, unknown == 1 ? " topic" : " topics", " of unknown delivery ");
      doubts.emplace_back(topics + "in the order of creation", delivered(kept, false));
      doubts.emplace_back(topics + "in the reverse order", delivered(kept, true));
    }
    const double budget_s = options_.budget_s * (1 - kRankingShare) / static_cast<double>(doubts.size());
    for (const auto& [assumption, candidates] : doubts)
      advice.doubts.push_back(doubted(advice, assumption, candidates, budget_s));
  }

  /// The candidates with the order of creation, or its reverse, wherever the order of delivery is unknown.
  static std::vector<Candidate> delivered(std::vector<Candidate> candidates, bool reversed) {
    for (Candidate& c : candidates) {
      for (const std::string& topic : unknown_deliveries(c.graph)) {
        std::vector<std::string>& nodes = c.graph.delivery[topic].nodes = subscribers_of(c.graph, topic);
        if (reversed) std::ranges::reverse(nodes);
      }
      set_delivery(c.graph, c.tasks);
    }
    return candidates;
  }

  Doubt doubted(const Advice& advice, const std::string& assumption, const std::vector<Candidate>& candidates,
                double budget_s) const {
    const std::vector<Prediction> predictions = predicted(assumption, candidates, budget_s);
    Doubt doubt{.assumption = assumption, .order = {}, .values = {}};
    for (const Prediction* p : ranked(predictions, objective_)) {
      const std::string& name = p->candidate->name;
      doubt.order.push_back(name);
      doubt.values.push_back(p->overload.empty() ? program::concat(name, " ", value_text(objective_, *p))
                                                 : name + " cannot keep up");
    }
    // Candidates that cannot be recommended may have been ahead before.
    std::vector<std::string> before;
    const std::string& best = advice.best->candidate->name;
    for (const Prediction* p : advice.ranked) {
      if (p == advice.best) break;
      before.push_back(p->candidate->name);
    }
    for (const std::string& name : doubt.order) {
      if (name == best) break;
      doubt.same_first = doubt.same_first && std::ranges::count(before, name) > 0;
    }
    return doubt;
  }

  /// Explains the difference between the current and the recommended executor in the first draw.
  void explain_gain(Advice& advice) const {
    const Prediction *const now = advice.now, *const best = advice.best;
    if (best == nullptr || best == now || !now->overload.empty() || graph_.chains.empty()) return;
    const Candidate &a = *now->candidate, &b = *best->candidate;
    const SimulatedDraw of_a = simulate_draw(a, options_, 0), of_b = simulate_draw(b, options_, 0);
    const auto run = [](const Candidate& c, const SimulatedDraw& d) {
      return explain::SimulatedRun{c.name, c.spec, c.graph, d.tasks, *d.times, d.repetition.trace};
    };
    advice.causes =
        explain::difference(run(a, of_a), run(b, of_b), static_cast<std::uint32_t>(objective_.chain));
  }

  /// Writes the recommended executors as files and returns the first.
  std::string write_change(const Advice& advice, const fs::path& folder) const {
    if (advice.best == nullptr || advice.best == advice.now) return "";
    const Candidate& c = *advice.best->candidate;
    Deployment plan;
    if (c.spec.deployment) {
      plan = c.spec.deployment->plan;
    } else {
      plan.executors.push_back(
          {graph_.name, c.spec.entry->name == c.name ? c.name : executor_text(c), {}, {}, 0});
      plan.executor_of.assign(c.tasks.set.size(), 0);
    }
    plan.name = "advice";
    plan.description = c.description;
    const fs::path file = folder / "deployment.yaml";
    program::write_whole_file(file, deployment_yaml(c.graph, c.tasks, plan));
    const bool has_graph = !write_executor_files(c, graph_.platform, "", folder).empty();
    if (c.sets_priorities && !has_graph) {
      Graph graph = c.graph;
      graph.platform = graph_.platform;
      write_graph(folder / "graph.yaml", graph, {"With the priorities that deployment.yaml needs.", {}},
                  program::write_with_folder);
    }
    try {
      const auto cie = [&](std::ostream& out) { write_cie(out, c.graph, c.tasks, plan); };
      if (c.spec.deployment && plan.executors.size() > 1)
        program::write_whole_file(folder / "cie.yaml", program::FileContent(cie));
    } catch (const std::invalid_argument&) {
      // CallbackIsolatedExecutor has an executor for each callback group; here some groups share.
    }
    return file.string();
  }

  /// Writes the contract of the recommended executor, and returns its file; empty: none is recommended.
  std::string write_contract(const Advice& advice, const fs::path& folder) const {
    if (advice.best == nullptr || !options_.contract) return "";
    const Candidate& c = *advice.best->candidate;
    Graph graph = c.graph;
    graph.platform = graph_.platform;
    const fs::path file = folder / "contract.yaml";
    program::write_whole_file(file, options_.contract(graph, c.tasks, c.spec));
    return file.string();
  }

  /// The executor's name in a deployment file.
  static std::string executor_text(const Candidate& c) {
    return c.sets_priorities ? std::string(c.spec.entry->name) : c.name;
  }

  void write(Advice& advice) const {
    const fs::path folder = setup::output_folder(options_, graph_);
    program::create_folder(folder);
    advice.change = write_change(advice, folder);
    const std::string contract = write_contract(advice, folder);
    if (!advice.causes.empty() && can_be_written(*advice.now->candidate)) {
      advice.stored.push_back(store_first_draw(*advice.now->candidate, options_, folder / "now"));
      advice.stored.push_back(store_first_draw(*advice.best->candidate, options_, folder / "recommended"));
    }
    if (!graph_.chains.empty()) write_latencies(folder / "latencies.csv", advice.ranked, objective_.chain);
    const nlohmann::json content = advice_json(advice);
    program::write_whole_file(folder / "advice.json", content);
    write_ranking(std::cout, advice);
    if (advice.draws < advice.asked_draws) {
      std::cout << "Only " << advice.draws << " of " << advice.asked_draws
                << " draws: the budget ended (--budget SECONDS).\n";
    }
    if (!graph_.chains.empty()) program::draw_figure("advice", folder);
    if (!contract.empty()) std::cout << "\nContract for `hotpath watch`: " << contract << "\n";
    std::cout << "\nResults: " << folder.string() << "\n" << std::flush;
    program::show_json(content);
  }

  Options options_;
  const Graph graph_;
  const Objective objective_;
  const CandidateOptions candidate_options_;
};

}  // namespace

void advise(const Options& options) {
  program::catch_interrupts();
  Adviser(options).run();
}

}  // namespace hotpath::advise
