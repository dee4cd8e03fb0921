// SPDX-License-Identifier: Apache-2.0
#include "advise/advice.hpp"

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <thread>

#include "advise/advice_report.hpp"
#include "advise/executor_file.hpp"
#include "advise/question.hpp"
#include "advise/ranking.hpp"
#include "advise/stored_draw.hpp"
#include "explain/explain.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
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

class Adviser : Question {
 public:
  explicit Adviser(const Options& given) : Question(given, "hot_path:p99") { check_memory(options, tasks); }

  void run() {
    const std::vector<Candidate> all = candidates("reference");
    Advice advice{graph, objective, {}, nullptr, nullptr, 0, 0, 0, {}, {}, {}, {}};
    std::vector<Prediction> predictions = predicted("ranking", all, kRankingShare * options.budget_s);
    for (Prediction& p : predictions) {
      if (p.overload.empty()) add_bound(p, objective);
    }
    advice.ranked = ranked(predictions, objective);
    advice.now =
        &*std::ranges::find_if(predictions, [&](const Prediction& p) { return p.candidate == &now(all); });
    advice.best = recommended(advice.ranked, *advice.now, objective);
    for (const Prediction& p : predictions) {
      advice.draws = std::max(advice.draws, static_cast<std::uint32_t>(p.draws.size()));
    }
    advice.asked_draws = draws();
    advice.seconds = options.duration_s;
    if (advice.best != nullptr && program::interrupted() == 0) doubt(advice);
    if (program::interrupted() == 0) explain_gain(advice);
    write(advice);
  }

 private:
  /// One draw suffices if nothing is random.
  std::uint32_t draws() const {
    const bool random = options.phases == Phases::random ||
                        graph.platform.execution_times != ExecutionTimeModel::worst ||
                        !unknown_deliveries(graph).empty();
    return random ? options.draws : 1;
  }

  std::vector<Prediction> predicted(const std::string& title, const std::vector<Candidate>& candidates,
                                    double budget_s) const {
    PredictionOptions o;
    o.common = options;
    o.draws = draws();
    o.budget = setup::seconds(budget_s);
    o.threads = options.threads;
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
    if (const std::size_t unknown = unknown_deliveries(graph).size(); unknown > 0) {
      const std::string topics =
          program::concat(unknown, unknown == 1 ? " topic" : " topics", " of unknown delivery ");
      doubts.emplace_back(topics + "in the order of creation", delivered(kept, false));
      doubts.emplace_back(topics + "in the reverse order", delivered(kept, true));
    }
    const double budget_s = options.budget_s * (1 - kRankingShare) / static_cast<double>(doubts.size());
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
    for (const Prediction* p : ranked(predictions, objective)) {
      const std::string& name = p->candidate->name;
      doubt.order.push_back(name);
      doubt.values.push_back(p->overload.empty() ? program::concat(name, " ", value_text(objective, *p))
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
    if (best == nullptr || best == now || !now->overload.empty() || graph.chains.empty()) return;
    const Candidate &a = *now->candidate, &b = *best->candidate;
    const SimulatedDraw of_a = simulate_draw(a, options, 0), of_b = simulate_draw(b, options, 0);
    const auto run = [](const Candidate& c, const SimulatedDraw& d) {
      return explain::SimulatedRun{c.name, c.spec, c.graph, d.tasks, *d.times, d.repetition.trace};
    };
    advice.causes =
        explain::difference(run(a, of_a), run(b, of_b), static_cast<std::uint32_t>(objective.chain));
  }

  /// Writes the recommended executors as files and returns the first.
  std::string write_change(const Advice& advice) const {
    if (advice.best == nullptr || advice.best == advice.now) return "";
    const Candidate& c = *advice.best->candidate;
    Deployment plan;
    if (c.spec.deployment) {
      plan = c.spec.deployment->plan;
    } else {
      plan.executors.push_back({graph.name, c.executor(), {}, {}, 0});
      plan.executor_of.assign(c.tasks.set.size(), 0);
    }
    plan.name = "advice";
    plan.description = c.description;
    const fs::path file = folder / "deployment.yaml";
    program::write_whole_file(file, deployment_yaml(c.graph, c.tasks, plan));
    (void)write_executor_files(c, graph.platform, "", folder);
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
  std::string write_contract(const Advice& advice) const {
    if (advice.best == nullptr || !options.contract) return "";
    const Candidate& c = *advice.best->candidate;
    Graph stated = c.graph;
    stated.platform = graph.platform;
    const fs::path file = folder / "contract.yaml";
    program::write_whole_file(file, options.contract(stated, c.tasks, c.spec));
    return file.string();
  }

  void write(Advice& advice) const {
    program::create_folder(folder);
    advice.change = write_change(advice);
    const std::string contract = write_contract(advice);
    if (!advice.causes.empty() && can_be_written(*advice.now->candidate)) {
      advice.stored.push_back(store_first_draw(*advice.now->candidate, options, folder / "now"));
      advice.stored.push_back(store_first_draw(*advice.best->candidate, options, folder / "recommended"));
    }
    if (!graph.chains.empty()) write_latencies(folder / "latencies.csv", advice.ranked, objective.chain);
    const nlohmann::json content = advice_json(advice);
    program::write_whole_file(folder / "advice.json", content);
    write_ranking(std::cout, advice);
    if (advice.draws < advice.asked_draws) {
      std::cout << "Only " << advice.draws << " of " << advice.asked_draws
                << " draws: the budget ended (--time-out SECONDS).\n";
    }
    if (!graph.chains.empty()) program::draw_figure("advice", folder);
    if (!contract.empty()) std::cout << "\nContract for `hotpath watch`: " << contract << "\n";
    finish(content);
  }
};

}  // namespace

void advise(const Options& options) {
  program::catch_interrupts();
  Options o = options;
  if (!o.phases_file.empty()) o.phases = Phases::given;
  if (!o.phases_of.empty()) {
    throw program::UsageError("--phases " + o.phases_of +
                              ": draws take the phases of a CSV file, not of a run");
  }
  Adviser(o).run();
}

}  // namespace hotpath::advise
