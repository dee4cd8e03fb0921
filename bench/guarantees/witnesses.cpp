// SPDX-License-Identifier: Apache-2.0
#include "guarantees/witnesses.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>

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
using bounds::Quantity;

constexpr std::int64_t kShortestRun_ms = 100;  // of `simulate`

/// Keeps what a file may be called everywhere.
std::string file_name(std::string name) {
  std::ranges::replace_if(
      name, [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '.' && c != ':'; }, '_');
  return name;
}

/// The execution times of all jobs that started, and release delays, as `simulate` reads them.
std::string list_of(const WitnessTimes& times, const TaskSet& set, const Trace& trace,
                    Duration longest_delivery) {
  struct Row {
    std::optional<Duration> time;
    Duration delay{};
    std::uint32_t end_round = 0;
    std::optional<Duration> delivery{};
  };
  std::map<std::pair<TaskId, std::uint64_t>, Row> rows;
  for (const JobRecord& r : trace.jobs) {
    if (r.started()) rows[{r.job.task, r.job.sequence}];
  }
  for (const auto& [job, time] : times.given()) rows[{job.task, job.sequence}].time = time;
  for (const auto& [job, delay] : times.given_delays()) rows[{job.task, job.sequence}].delay = delay;
  for (const auto& [job, round] : times.given_rounds()) rows[{job.task, job.sequence}].end_round = round;
  for (const auto& [sample, delay] : times.given_deliveries()) rows[sample].delivery = delay;
  const bool deliveries = !times.given_deliveries().empty();
  const bool delays = !times.given_delays().empty(), rounds = !times.given_rounds().empty();
  std::string list(simulated::kListedColumns);
  if (delays) list += program::concat(",", simulated::kListedDelay);
  if (rounds) list += program::concat(",", simulated::kListedRound);
  if (deliveries) list += program::concat(",", simulated::kListedDelivery);
  for (const auto& [job, row] : rows) {
    const Task& task = set[job.first];
    list += program::concat("\n", task.name, ",", job.second, ",", row.time.value_or(task.wcet).count());
    if (delays) list += program::concat(",", row.delay.count());
    if (rounds) list += program::concat(",", row.end_round);
    if (deliveries) list += program::concat(",", row.delivery.value_or(longest_delivery).count());
  }
  return list + "\n";
}

std::int64_t largest(const results::Repetition& repetition, const bounds::ReachedWorstCase& worst) {
  Duration largest{-1};
  for (const JobRecord& r : repetition.trace.jobs) {
    if (worst.kind == Quantity::task && r.outcome == Outcome::ran && r.job.task == worst.number)
      largest = std::max(largest, r.response_time());
  }
  for (const ChainRecord& c : repetition.trace.chains) {
    if (worst.kind == Quantity::task || c.chain != worst.number) continue;
    largest = std::max(largest, worst.kind == Quantity::chain ? c.end_to_end_latency : c.hot_path_latency);
  }
  return largest.count();
}

void write(const fs::path& file, const std::string& content) {
  program::write_whole_file(file, "--witness", content);
}

/// The options of all simulations of witnesses in this folder, into which it writes their inputs.
simulated::Options common_options(const fs::path& folder, const Graph& graph, const TaskSet& set,
                                  const setup::ExecutorSpec& executor, const setup::CommonOptions& options) {
  simulated::Options common;
  common.graph = folder / "graph.yaml";
  write_graph(common.graph, graph);
  common.phases = Phases::given;
  common.phases_file = folder / "phases.csv";
  std::vector<Duration> first;
  first.reserve(set.size());
  for (const Task& task : set.tasks) first.push_back(task.phase);
  write(common.phases_file, phases_csv(set, first));
  if (!executor.scheduler.entity_order.empty()) {
    std::string order;
    for (const TaskId id : executor.scheduler.entity_order) order += set[id].name + "\n";
    common.entity_order = {.file = folder / "entity_order.txt"};
    write(common.entity_order.file, order);
  }
  common.executors = {executor.label};
  common.rule = options.rule;
  common.ties = options.ties;
  common.warm_up_s = 0;
  common.threads = 1;
  return common;
}

void store(simulated::Options o, const fs::path& folder, double seconds) {
  o.execution_times = {.model = {}, .listed = folder.string() + ".csv"};
  o.duration_s = seconds;
  o.output = folder;
  simulated::store_simulation(o);
}

}  // namespace

std::string write_witnesses(const std::vector<bounds::ReachedWorstCase>& worst_cases, const Graph& graph,
                            const GraphTasks& tasks, const setup::ExecutorSpec& executor,
                            const setup::CommonOptions& options, const fs::path& folder) {
  const fs::path own = folder / file_name(executor.label);
  program::create_folder(own, "--witness");
  const simulated::Options common = common_options(own, graph, tasks.set, executor, options);
  std::string lines;
  for (const bounds::ReachedWorstCase& worst : worst_cases) {
    const bool of_task = worst.kind == Quantity::task;
    const std::string quantity = of_task                            ? "response_"
                                 : worst.kind == Quantity::hot_path ? "hot_path_"
                                                                    : "age_";
    const std::string subject =
        quantity + (of_task ? tasks.set[worst.number].name : graph.chains[worst.number].name);
    fs::path run = own / file_name(subject);
    while (fs::exists(run)) run += "_";
    const WitnessTimes times(tasks.set, worst.witness);
    simulated::Plan plan{executor, graph, tasks, times};
    const std::int64_t ms =
        std::max<std::int64_t>(kShortestRun_ms, (worst.witness.instant - Time{}).count() / 1'000'000 + 1);
    plan.duration = std::chrono::milliseconds(ms);
    const results::Repetition repetition = simulated::simulate_repetition(plan);
    if (const std::int64_t reached = largest(repetition, worst); reached != worst.value_ns) {
      throw program::RunError(program::concat("the schedule for the ", subject, " of ", worst.value_ns,
                                              " ns under ", executor.label, " gives ", reached,
                                              " ns. Please report the graph ", own / "graph.yaml"));
    }
    write(run.string() + ".csv", list_of(times, tasks.set, repetition.trace, graph.platform.delivery_delay));
    store(common, run, static_cast<double>(ms) / 1000);
    lines += program::concat("Witness: ", program::fixed(to_ms(Duration(worst.value_ns)), 6), " ms, ",
                             run.string(), "\n");
  }
  return lines;
}

}  // namespace hotpath::guarantees
