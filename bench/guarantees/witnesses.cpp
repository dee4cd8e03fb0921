// SPDX-License-Identifier: Apache-2.0
#include "guarantees/witnesses.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <ostream>
#include <sstream>

#include "hotpath/reference_system/graph_writer.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "results/measures.hpp"
#include "results/run_record.hpp"
#include "simulated/own_times.hpp"
#include "simulated/repetition.hpp"
#include "simulated/simulated_run.hpp"

namespace hotpath::guarantees {

namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kShortestRun_ms = 100;  // of `simulate`

std::string in_ms(Duration d) {
  return program::text("%lld.%06lld", static_cast<long long>(d.count() / 1'000'000),
                       static_cast<long long>(d.count() % 1'000'000));
}

/// Keeps what a file may be called everywhere.
std::string file_name(std::string name) {
  std::ranges::replace_if(
      name, [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '.' && c != ':'; }, '_');
  return name;
}

class Witnesses {
 public:
  Witnesses(const Graph& graph, const GraphTasks& tasks, const setup::ExecutorSpec& executor,
            const setup::CommonOptions& options, const fs::path& folder, std::ostream& out)
      : graph_(graph),
        tasks_(tasks),
        executor_(executor),
        folder_(folder / file_name(executor.label)),
        out_(out) {
    program::create_folder(folder_, "--witness");
    const fs::path graph_file = folder_ / "graph.yaml";
    write_graph(graph_file, graph);
    std::vector<Duration> first;
    for (const Task& task : tasks.set.tasks) first.push_back(task.phase);
    write("phases.csv", phases_csv(tasks.set, first));
    std::string order;
    for (const TaskId id : executor.scheduler.entity_order) order += tasks.set[id].name + "\n";
    if (!order.empty()) write("entity_order.txt", order);
    simulation_.graph = graph_file;
    simulation_.executors = {executor.label};
    simulation_.rule = options.rule;
    simulation_.ties = options.ties;
    simulation_.entity_order = order.empty() ? "creation" : (folder_ / "entity_order.txt").string();
    simulation_.phases_file = folder_ / "phases.csv";
    simulation_.warm_up_s = 0;
    simulation_.threads = 1;
  }

  void add(const bounds::ReachedWorstCase& worst) {
    const WitnessTimes times(tasks_.set, worst.witness);
    const std::string quantity = worst.kind == bounds::Quantity::task       ? "response_"
                                 : worst.kind == bounds::Quantity::hot_path ? "hot_path_"
                                                                            : "age_";
    const std::string& subject = worst.kind == bounds::Quantity::task ? tasks_.set[worst.number].name
                                                                      : graph_.chains[worst.number].name;
    std::string name = file_name(quantity + subject);
    while (fs::exists(folder_ / name)) name += "_";
    const std::int64_t ms =
        std::max<std::int64_t>(kShortestRun_ms, (worst.witness.instant - Time{}).count() / 1'000'000 + 1);
    simulated::Plan plan{executor_, graph_, tasks_, times};
    plan.duration = std::chrono::milliseconds(ms);
    const results::Repetition repetition = simulated::simulate_repetition(plan);
    if (const std::int64_t reached = largest(repetition, worst); reached != worst.value_ns) {
      throw program::RunError(program::concat(
          "the schedule for the ", quantity, subject, " of ", worst.value_ns, " ns under ", executor_.label,
          " gives ", reached, " ns. Please report the graph ", folder_ / "graph.yaml"));
    }
    write(name + ".csv", list_of(times, repetition.trace));
    store(name, static_cast<double>(ms) / 1000);
    out_ << "Witness: " << in_ms(Duration(worst.value_ns)) << " ms, " << (folder_ / name).string() << "\n";
  }

 private:
  void write(const std::string& name, const std::string& content) const {
    program::write_whole_file(folder_ / name, "--witness", content);
  }

  /// The execution times of all jobs that started, and release delays, as `simulate` reads them.
  std::string list_of(const WitnessTimes& times, const Trace& trace) const {
    struct Row {
      std::optional<Duration> time;
      Duration delay{};
    };
    std::map<std::pair<TaskId, std::uint64_t>, Row> rows;
    for (const JobRecord& r : trace.jobs) {
      if (started(r)) rows[{r.job.task, r.job.sequence}];
    }
    for (const auto& [job, time] : times.given()) rows[{job.task, job.sequence}].time = time;
    for (const auto& [job, delay] : times.given_delays()) rows[{job.task, job.sequence}].delay = delay;
    const bool delays = !times.given_delays().empty();
    std::string list(simulated::kListedColumns);
    if (delays) list += program::concat(",", simulated::kListedDelay);
    for (const auto& [job, row] : rows) {
      const Task& task = tasks_.set[job.first];
      list += program::concat("\n", task.name, ",", job.second, ",", row.time.value_or(task.wcet).count());
      if (delays) list += program::concat(",", row.delay.count());
    }
    return list + "\n";
  }

  static std::int64_t largest(const results::Repetition& repetition, const bounds::ReachedWorstCase& worst) {
    Duration largest{-1};
    for (const JobRecord& r : repetition.trace.jobs) {
      if (worst.kind != bounds::Quantity::task || r.outcome != Outcome::ran || r.job.task != worst.number)
        continue;
      largest = std::max(largest, results::response_time(r));
    }
    for (const ChainRecord& c : repetition.trace.chains) {
      if (worst.kind == bounds::Quantity::task || c.chain != worst.number) continue;
      largest = std::max(largest,
                         worst.kind == bounds::Quantity::chain ? c.end_to_end_latency : c.hot_path_latency);
    }
    return largest.count();
  }

  void store(const std::string& name, double seconds) {
    simulated::Options o = simulation_;
    o.execution_times = std::string(simulated::kListed) + (folder_ / (name + ".csv")).string();
    o.duration_s = seconds;
    o.output = folder_ / name;
    // In the order of the options of `simulate`, so that the command's own run has the same run.json.
    o.command = {"simulate", "--executors=" + o.executors.front(), "--graph=" + o.graph,
                 "--phases=" + o.phases_file};
    if (o.entity_order != "creation") o.command.push_back("--entity-order=" + o.entity_order);
    o.command.insert(o.command.end(), {program::text("--duration=%.3f", seconds), "--warm-up=0",
                                       "--execution-times=" + *o.execution_times});
    simulated::store_simulation(o);
  }

  const Graph& graph_;
  const GraphTasks& tasks_;
  const setup::ExecutorSpec& executor_;
  const fs::path folder_;
  std::ostream& out_;
  simulated::Options simulation_;
};

}  // namespace

std::string write_witnesses(const std::vector<bounds::ReachedWorstCase>& worst_cases, const Graph& graph,
                            const GraphTasks& tasks, const setup::ExecutorSpec& executor,
                            const setup::CommonOptions& options, const fs::path& folder) {
  std::ostringstream out;
  Witnesses witnesses(graph, tasks, executor, options, folder, out);
  for (const bounds::ReachedWorstCase& worst : worst_cases) witnesses.add(worst);
  return out.str();
}

}  // namespace hotpath::guarantees
