// SPDX-License-Identifier: Apache-2.0
#include "advise/advice.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>

#include "advise/advice_report.hpp"
#include "explain/explain.hpp"
#include "hotpath/analysis/parallel.hpp"
#include "hotpath/core/trace_csv.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "results/stored_summary.hpp"
#include "simulated/simulated_run.hpp"

namespace hotpath::advise {

namespace fs = std::filesystem;

namespace {

using program::concat, program::text;

/// PriorityExecutor's default.
constexpr Duration kServiceWait = std::chrono::milliseconds(100);
/// Number of best candidates in the doubts, in addition to the current executor.
constexpr std::size_t kDoubted = 3;
/// The ranking's share of the budget; the rest is for the doubts.
constexpr double kRankingShare = 0.6;

/// Rejects a graph that does not fit into memory: every candidate has a graph and tasks, and every
/// candidate under simulation has a trace.
void check_memory(const Question& q) {
  constexpr double kCandidates = 30, kBytesOfTask = 2500;  // measured with 1000 to 20,000 nodes
  setup::check_trace_memory(q.options, q.tasks, thread_count(q.options.threads),
                            kCandidates * kBytesOfTask * q.tasks.set.size(),
                            "a shorter --duration, fewer --threads, or a part of the graph");
}

/// Predicts within a share of the budget.
std::vector<Prediction> predicted(const Advice& advice, const std::string& title,
                                  const std::vector<Candidate>& candidates, double share) {
  Options options = advice.options;
  options.draws = advice.asked_draws();
  options.budget_s *= share;
  return predict(candidates, options, advice.objective, title);
}

Doubt doubted(const Advice& advice, const std::string& assumption,
              const std::vector<Prediction>& predictions) {
  Doubt doubt{.assumption = assumption, .order = {}, .values = {}};
  for (const Prediction& p : predictions) {
    const std::string& name = doubt.order.emplace_back(p.candidate->name);
    doubt.values.push_back(name + (p.keeps_up() ? " " + value_text(advice.objective, p) : " cannot keep up"));
  }
  // Candidates that cannot be recommended may have been ahead before.
  const std::span<const Prediction> ahead(advice.ranked.data(), advice.best);
  const auto ahead_before = [&](const std::string& name) {
    return std::ranges::any_of(ahead, [&](const Prediction& p) { return p.candidate->name == name; });
  };
  const auto best = std::ranges::find(doubt.order, advice.best->candidate->name);
  doubt.same_first = std::all_of(doubt.order.begin(), best, ahead_before);
  return doubt;
}

/// The rankings of the best candidates under changed assumptions.
std::vector<Doubt> doubts(const Advice& advice) {
  std::vector<const Candidate*> kept;
  for (const Prediction& p : advice.ranked) {
    const bool one_of_best = kept.size() < kDoubted && p.keeps_up();
    if (one_of_best || &p == advice.best || &p == advice.now) kept.push_back(p.candidate);
  }
  const std::vector<std::string> unknown = unknown_deliveries(advice.graph);
  const double share = (1 - kRankingShare) / (unknown.empty() ? 2 : 4);
  std::vector<Doubt> all;
  const auto add = [&](const std::string& assumption, const std::function<void(Graph&)>& change) {
    std::vector<Candidate> candidates;
    candidates.reserve(kept.size());
    for (const Candidate* c : kept) {
      Graph graph = c->graph;
      change(graph);
      candidates.push_back(with_graph(*c, std::move(graph)));
    }
    all.push_back(doubted(advice, assumption, predicted(advice, assumption, candidates, share)));
  };
  add("execution times 20 % longer", [](Graph& g) {
    constexpr double kLonger = 1.2;
    if (load_percent(g) > 0) scale_to_load(g, kLonger * load_percent(g));
  });
  add("one more core", [](Graph& g) { ++g.platform.cores; });
  for (const std::string order : {"order of creation", "reverse order"}) {
    if (unknown.empty()) break;
    const std::string topics = unknown.size() == 1 ? " topic" : " topics";
    add(concat(unknown.size(), topics, " of unknown delivery in the ", order), [&](Graph& g) {
      for (const std::string& topic : unknown) {
        std::vector<std::string>& nodes = g.delivery[topic].nodes = subscribers_of(g, topic);
        if (order == "reverse order") std::ranges::reverse(nodes);
      }
    });
  }
  return all;
}

/// Why the recommended executor is faster than the current one in the first draw.
std::vector<std::string> causes_of_gain(const Advice& advice) {
  if (!advice.compares() || advice.graph.chains.empty()) return {};
  const Candidate &a = *advice.now->candidate, &b = *advice.best->candidate;
  const SimulatedDraw of_a = simulate_draw(a, advice.options, 0), of_b = simulate_draw(b, advice.options, 0);
  const auto run = [](const Candidate& c, const SimulatedDraw& d) {
    return explain::SimulatedRun{{c.spec, c.graph, d.tasks, *d.times}, d.repetition.trace};
  };
  return explain::difference(run(a, of_a), run(b, of_b), static_cast<std::uint32_t>(advice.objective.chain),
                             advice.objective.latency);
}

/// Fills in the answer.
void answer(Advice& advice) {
  check_memory(advice);
  advice.candidates = advice.candidates_to_compare();
  advice.ranked = predicted(advice, "ranking", advice.candidates, kRankingShare);
  const Candidate* const now = &advice.current(advice.candidates);
  for (Prediction& p : advice.ranked) {
    if (p.candidate == now) advice.now = &p;
  }
  advice.best = recommended(advice.ranked, *advice.now, advice.objective);
  if (advice.best != nullptr && program::interrupted() == 0) advice.doubts = doubts(advice);
  if (program::interrupted() == 0) advice.causes = causes_of_gain(advice);
}

/// Writes the recommended candidate as deployment.yaml, and as far as they can express it as the executor
/// files. Returns deployment.yaml.
std::string write_change(const Candidate& c, const Graph& graph, const fs::path& folder) {
  Deployment plan = c.spec.entry ? find_deployment("single", graph, c.tasks) : c.spec.plan;
  if (c.spec.entry) plan.executors.front().executor = c.executor();
  plan.name = "advice";
  plan.description = c.description;
  program::write_whole_file(folder / "deployment.yaml", deployment_yaml(c.graph, c.tasks, plan));
  (void)write_executor_files(c, graph.platform, "", folder);
  return folder / "deployment.yaml";
}

/// Stores the first draw of a candidate in `folder`: graph.yaml with the candidate's costs and priorities,
/// deployment.yaml for a deployment, and run/, the run of `hotpath simulate` that repeats the draw. Returns
/// the executor's label in the run. Throws UsageError, and OverloadError if the candidate cannot keep up.
std::string store_first_draw(const Candidate& candidate, const setup::CommonOptions& options,
                             const fs::path& folder) {
  program::create_folder(folder);
  simulated::Options o;
  static_cast<setup::CommonOptions&>(o) = options;
  o.graph = folder / "graph.yaml";
  write_graph(o.graph, with_drawn_deliveries(candidate.graph, options.seed),
              {"The graph of one candidate, with the candidate's costs.", {}}, program::write_with_folder);
  o.load_given = o.rate_percent = std::nullopt;
  o.copies = o.repetitions = o.threads = 1;
  o.set.clear();
  o.executors.clear();
  o.deployments.clear();
  std::string label = candidate.executor();
  if (!candidate.spec.entry) {
    Deployment plan = candidate.spec.plan;
    plan.name = candidate.name;
    o.deployments = {folder / "deployment.yaml"};
    program::write_whole_file(o.deployments.front(), deployment_yaml(candidate.graph, candidate.tasks, plan));
  } else {
    o.executors = {label};
  }
  o.output = folder / "run";
  o.command.clear();
  simulated::store_simulation(o);
  return label;
}

/// Writes the latencies of one chain in all draws, in the format of chains.csv, and returns them.
results::SampleRows write_latencies(const fs::path& file, const std::vector<Prediction>& predictions,
                                    std::size_t chain) {
  results::SampleRows all;
  program::write_whole_file(file, [&](std::ostream& out) {
    out << kChainsCsvHeader << "\n";
    for (const Prediction& p : predictions) {
      for (const results::Repetition& draw : p.draws) {
        if (!p.keeps_up()) continue;
        Trace trace;
        trace.executor = p.candidate->name;
        trace.repetition = draw.trace.repetition;
        std::ranges::copy_if(draw.trace.chains, std::back_inserter(trace.chains),
                             [&](const ChainRecord& r) { return r.chain == chain; });
        const std::vector<std::string> names = setup::chain_names(p.candidate->graph);
        write_chains_csv(out, p.candidate->tasks.set, names, trace);
        if (trace.chains.empty()) continue;
        all.push_back(
            {{"name", names[chain]}, {"executor", trace.executor}, {"repetition", trace.repetition}});
        for (const ChainRecord& output : trace.chains) results::add(all.back(), output);
      }
    }
  });
  return all;
}

/// Writes the contract of the recommended executor, and returns its file; empty: none is recommended.
std::string write_contract(const Advice& advice) {
  if (advice.best == nullptr || !advice.options.contract) return "";
  const Candidate& c = *advice.best->candidate;
  const fs::path file = advice.folder / "contract.yaml";
  program::write_whole_file(file, advice.options.contract(c.graph, c.tasks, c.spec));
  return file.string();
}

void write(Advice& advice) {
  program::create_folder(advice.folder);
  if (advice.changes()) advice.change = write_change(*advice.best->candidate, advice.graph, advice.folder);
  const std::string contract = write_contract(advice);
  if (!advice.causes.empty() && can_be_written(*advice.now->candidate)) {
    for (const auto& [p, name] : {std::pair(advice.now, "now"), {advice.best, "recommended"}})
      advice.stored.push_back(store_first_draw(*p->candidate, advice.options, advice.folder / name));
  }
  const bool chains = !advice.graph.chains.empty();
  const nlohmann::json content = advice;
  nlohmann::json with_samples = content;
  if (chains)
    with_samples["latencies"] =
        write_latencies(advice.folder / "latencies.csv", advice.ranked, advice.objective.chain);
  program::write_whole_file(advice.folder / "advice.json", with_samples);
  write_text(std::cout, advice, content);
  if (advice.draws() > 0 && advice.draws() < advice.asked_draws()) {
    std::cout << "Only " << advice.draws() << " of " << advice.asked_draws() << " draws: "
              << (program::interrupted() != 0 ? "interrupted" : "the budget ended (--time-out SECONDS)")
              << ".\n";
  }
  const auto has_outputs = [&](const Prediction& p) {
    return chains && p.keeps_up() && p.summary.chains[advice.objective.chain].hot_path.quantiles.n > 0;
  };
  if (std::ranges::any_of(advice.ranked, has_outputs)) program::draw_figure("advice", advice.folder);
  if (!contract.empty()) std::cout << "\nContract for `hotpath watch`: " << contract << "\n";
  if (advice.changes())
    std::cout << installation(advice.folder, fs::absolute(advice.folder).lexically_normal());
  advice.finish(content);
}

}  // namespace

std::vector<std::string> write_executor_files(const Candidate& candidate, const GraphPlatform& platform,
                                              const std::string& offsets, const fs::path& folder) {
  const std::span<const setup::ExecutorSpec> parts = setup::parts(candidate.spec);
  const setup::ExecutorSpec& executor = parts.front();
  const auto differs = [&](const setup::ExecutorSpec& part) { return part.label != executor.label; };
  if (executor.entry->traits.family == Family::wait_set || std::ranges::any_of(parts, differs)) return {};
  Graph graph = candidate.graph;
  graph.platform = platform;
  const std::string priorities = candidate.sets_priorities ? "With the priorities that executor.yaml needs."
                                                           : "The graph of executor.yaml.";
  write_graph(folder / "graph.yaml", graph, {priorities, {}}, program::write_with_folder);

  const SchedulerOptions& scheduler = executor.scheduler;
  const bool queue = executor.entry->traits.family == Family::priority_events;
  std::string options = concat(
      "# Options of hotpath_rclcpp's PriorityExecutor, for each process of the system:\n"
      "# PriorityExecutorOptions::from_file(), or the parameter `config` of\n"
      "# component_container_hotpath. Paths are relative to this file.\n",
      "executor: ", setup::name_with_rules(*executor.entry, scheduler),
      "\nthreads: ", candidate.load.threads / parts.size(), "\ngraph: graph.yaml\n");
  // Of graphs, the default is 0; a robot whose graph states none has services of parameters all the same.
  const bool stated = scheduler.service_wait > Duration::zero();
  if (queue)
    options += text("service_wait_ms: %.15g\n", to_ms(stated ? scheduler.service_wait : kServiceWait));
  if (!offsets.empty()) options += "offsets: " + offsets + "\n";
  program::write_whole_file(folder / "executor.yaml", options);
  return {folder / "graph.yaml", folder / "executor.yaml"};
}

std::string installation(const fs::path& folder, const fs::path& shown) {
  if (!fs::exists(folder / "executor.yaml")) return "";
  const std::string file = shown / "executor.yaml";
  return concat(R"(
Install it in one of three ways:

1. In C++; in CMake with find_package(hotpath_rclcpp REQUIRED) and the target hotpath_rclcpp::hotpath_rclcpp:

#include <hotpath_rclcpp/priority_executor.hpp>

hotpath::PriorityExecutor executor{hotpath::PriorityExecutorOptions::from_file(")",
                file, R"(")};
executor.add_node(node);
executor.spin();

2. In a launch file, for nodes of a component container:

from launch_ros.actions import ComposableNodeContainer

container = ComposableNodeContainer(
    name="container", namespace="", package="hotpath_rclcpp", executable="component_container_hotpath",
    parameters=[{"config": ")",
                file, R"("}], composable_node_descriptions=[])

3. In the shell, where hotpath_rclcpp is sourced, before a program that calls rclcpp::spin(node):

export LD_PRELOAD=libhotpath_rclcpp_spin.so HOTPATH_EXECUTOR=)",
                file, "\n");
}

void advise(const Options& options) {
  program::catch_interrupts();
  if (!options.phases_of.empty()) {
    throw program::UsageError("--phases " + options.phases_of +
                              ": draws take the phases of a CSV file, not of a run");
  }
  Advice advice(options);
  answer(advice);
  write(advice);
}

}  // namespace hotpath::advise
