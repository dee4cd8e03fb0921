// SPDX-License-Identifier: Apache-2.0
#include "page/page_data.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_layout.hpp"
#include "page/listed_outputs.hpp"
#include "page/stored_jobs.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "results/stored_summary.hpp"
#include "setup/stored_system.hpp"

namespace hotpath::page {

using nlohmann::json;

namespace {

constexpr std::size_t kWorst = 10;             // outputs of a chain whose jobs a thinned page keeps
constexpr std::size_t kMostOfTask = 20;        // explained jobs of a task under an executor
constexpr std::size_t kMostRows = 20'000'000;  // rows of jobs.csv to read for all chains

/// The largest numbers in a page; above them, it is thinned. Each run may fill an equal share.
struct Share {
  std::size_t jobs = 100'000, outputs = 5'000, parts = 250'000;  // parts of all explained outputs
};

json graph_json(const Graph& graph, const GraphTasks& tasks) {
  json nodes = json::array(), edges = json::array(), chains = json::array(), node_of = json::array();
  const std::vector<GraphPosition> positions = graph_layout(graph);
  for (std::size_t n = 0; n < graph.nodes.size(); ++n) {
    nodes.push_back({{"name", graph.nodes[n].name},
                     {"type", to_string(graph.nodes[n].type)},
                     {"column", positions[n].column},
                     {"row", positions[n].row}});
  }
  for (const GraphEdge& e : graph_edges(graph)) edges.push_back({e.source, e.target});
  for (const TaskOrigin& origin : tasks.origin) node_of.push_back(origin.node);
  const std::vector<ChainIndex> indices = index_chains(graph, tasks);
  for (std::size_t c = 0; c < indices.size(); ++c) {
    json of_chain = json::array();
    for (const std::vector<TaskId>& of_node : indices[c].nodes) {
      for (const TaskId id : of_node) of_chain.push_back(id);
    }
    chains.push_back({{"name", graph.chains[c].name}, {"tasks", of_chain}});
  }
  return {{"nodes", nodes}, {"edges", edges}, {"chains", chains}, {"node_of_task", node_of}};
}

/// The data of one run.
class RunData {
 public:
  RunData(const results::StoredRun& run, Share share) : run_(run), share_(share) {}

  json finish() {
    json data = {{"executors", run_.executors()}, {"tasks", json::array()}};
    for (const Task& task : run_.tasks().tasks) data["tasks"].push_back(task.name);
    const std::size_t rows = run_.tasks().tasks.empty() ? 0 : count_jobs(run_);
    if (rows == 0) {
      notes_.emplace_back("The run stores no jobs, so the page has neither timelines nor causes.");
    } else {
      add_graph(data);
      add_outputs(data, rows);
      add_tasks(data, rows);
      ShownJobs jobs = shown_jobs(run_, rows, share_.jobs, std::move(wanted_));
      data["repetitions"] = std::move(jobs.repetitions);
      if (jobs.kept < jobs.started) {
        notes_.push_back(program::concat("The timeline holds ", jobs.kept, " of ", jobs.started,
                                         " jobs: the first ones of each executor, and those around its ",
                                         kWorst, " worst outputs of each chain."));
      }
    }
    data["notes"] = notes_;
    return data;
  }

 private:
  void add_graph(json& data) {
    try {
      const setup::StoredSystem system = setup::stored_system(run_);
      data["graph"] = graph_json(system.graph, system.tasks);
    } catch (const std::exception& error) {
      notes_.push_back(program::concat("The page shows neither the graph nor causes: ", error.what()));
    }
  }

  void add_outputs(json& data, std::size_t rows) {
    data["outputs"] = json::array();
    if (!data.contains("graph")) return;
    const std::size_t pairs = run_.chains().size() * run_.executors().size();
    const std::size_t readable = std::max<std::size_t>(1, kMostRows / rows);
    const std::size_t most = std::max<std::size_t>(20, share_.outputs / std::max<std::size_t>(1, pairs));
    std::size_t thinned = 0, pair = 0;
    for (const std::string& chain : run_.chains()) {
      for (const std::string& executor : run_.executors()) {
        if (pair++ < readable) thinned += add_outputs(data["outputs"], chain, executor, most);
      }
    }
    if (thinned > 0) {
      notes_.push_back(program::concat("Lists have up to ", most,
                                       " outputs of a chain under an executor: the worst ", most / 2,
                                       ", and evenly distributed others."));
    }
    if (pairs > readable) {
      notes_.push_back(program::concat("Because of its size, the page leaves out the causes of the last ",
                                       pairs - readable, " of ", pairs,
                                       " pairs of chain and executor; `hotpath explain` has them."));
    }
  }

  /// The slowest jobs of each task under each executor.
  void add_tasks(json& data, std::size_t rows) {
    const std::size_t tasks = run_.tasks().size(), executors = run_.executors().size();
    const std::size_t most = std::min(kMostOfTask, share_.outputs / (tasks * executors));
    data["responses"] = json::array();
    if (!data.contains("graph")) return;
    if (most == 0 || rows > kMostRows / tasks) {
      notes_.emplace_back(
          "Because of its size, the page leaves out the causes of response times of tasks; "
          "`hotpath explain --task` has them.");
      return;
    }
    try {
      explain::Options options;
      options.slowest = most;
      for (const std::string& executor : run_.executors()) {
        std::vector<std::vector<explain::Explanation>> slowest(tasks);
        explain::StoredOutputs jobs(run_, executor, options);
        jobs.explain(jobs.outputs(),
                     [&](const explain::Explanation& of) { slowest[of.path.back().job.task].push_back(of); });
        for (TaskId task = 0; task < tasks; ++task) {
          data["responses"].push_back(
              {{"task", task},
               {"executor", executor},
               {"outputs", outputs_json(slowest[task], share_.parts / (tasks * executors))}});
        }
      }
    } catch (const program::UsageError& error) {
      notes_.push_back(program::concat("The page shows no causes of response times: ", error.what()));
    }
  }

  /// Returns whether outputs were left out.
  bool add_outputs(json& outputs, const std::string& chain, const std::string& executor, std::size_t most) {
    try {
      explain::Options options;
      options.chain = chain;
      explain::StoredOutputs stored(run_, executor, options);
      std::vector<explain::Explanation> explained;
      stored.explain(listed(stored.outputs(), most),
                     [&](const explain::Explanation& e) { explained.push_back(e); });
      const std::size_t most_parts = share_.parts / (run_.chains().size() * run_.executors().size());
      std::size_t parts = 0;
      for (const explain::Explanation& e : explained) parts += e.parts.size();
      if (parts > most_parts) {
        notes_.push_back(program::concat("Only the worst outputs of ", chain, " under ", executor,
                                         " have their causes in the order of time, because these are many."));
      }
      outputs.push_back(
          {{"chain", chain}, {"executor", executor}, {"outputs", outputs_json(explained, most_parts)}});
      explained.resize(std::min(explained.size(), kWorst));
      for (const explain::Explanation& e : explained) {
        const Time end = e.path.back().finish;
        wanted_[{executor, e.repetition}].emplace_back(end - e.latency - e.latency / 2, end + e.latency / 2);
      }
      return stored.outputs().size() > most;
    } catch (const program::UsageError& error) {
      notes_.push_back(
          program::concat("The page shows no causes of ", chain, " under ", executor, ": ", error.what()));
      return false;
    }
  }

  const results::StoredRun& run_;
  const Share share_;
  WantedIntervals wanted_;
  std::vector<std::string> notes_;
};

}  // namespace

json page_data(const std::vector<std::string>& folders) {
  json data = {{"causes", json::array()}, {"rules", json::array()}, {"runs", json::array()}};
  for (const auto& cause : explain::kCauseTexts)
    data["causes"].push_back({{"name", cause.text}, {"phrase", cause.phrase}, {"colour", cause.colour}});
  for (const auto& [rule, word] : explain::enum_texts(explain::Rule{})) data["rules"].push_back(word);
  Share share;
  for (std::size_t* const number : {&share.jobs, &share.outputs, &share.parts}) *number /= folders.size();
  for (const std::string& folder : folders) {
    try {
      const results::StoredRun run(folder, "report");
      data["runs"].push_back(RunData(run, share).finish());
    } catch (const program::UsageError&
                 error) {  // no complete run of this version: its summary can still be shown
      const std::string note =
          program::concat("The page shows neither jobs nor causes of this run: ", error.what());
      data["runs"].push_back(
          {{"executors", json::array()}, {"tasks", json::array()}, {"notes", json::array({note})}});
    }
  }
  return data;
}

}  // namespace hotpath::page
