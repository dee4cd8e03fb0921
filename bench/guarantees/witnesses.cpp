// SPDX-License-Identifier: Apache-2.0
#include "guarantees/analyze.hpp"

#include <algorithm>
#include <cctype>
#include <optional>

#include "hotpath/reference_system/graph_file.hpp"
#include "program/errors.hpp"
#include "program/table.hpp"
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

/// Keeps what a file may be called everywhere.
std::string file_name(std::string name) {
  std::ranges::replace_if(
      name, [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '.' && c != ':'; }, '_');
  return name;
}

/// All jobs that started, as `simulate` reads them.
std::string list_of(const GivenJobs& given, const TaskSet& set, const Trace& trace,
                    Duration longest_delivery) {
  GivenJobs jobs = given;
  for (const JobRecord& r : trace.jobs) {
    if (r.started()) jobs[{r.job.task, r.job.sequence}];
  }
  using Row = GivenJobs::value_type;
  const auto& names = simulated::kListedColumns;
  std::vector<program::Column<Row>> columns = {
      {names[0], [&](const Row& row) { return set[row.first.first].name; }},
      {names[1], [](const Row& row) { return row.first.second; }},
      {names[2], [&](const Row& row) { return row.second.time.value_or(set[row.first.first].wcet); }}};
  const auto add_if_given = [&](const char* name, auto member, auto otherwise) {
    if (std::ranges::any_of(jobs, [&](const Row& row) { return (row.second.*member).has_value(); }))
      columns.emplace_back(name, [=](const Row& row) { return (row.second.*member).value_or(otherwise); });
  };
  add_if_given(names[3], &GivenJob::delay, Duration{});
  add_if_given(names[4], &GivenJob::end_round, 0U);
  add_if_given(names[5], &GivenJob::delivery, longest_delivery);
  return csv_of(program::table_of(columns, std::vector<Row>(jobs.begin(), jobs.end())));
}

std::int64_t largest(const results::Repetition& repetition, const bounds::ReachedWorstCase& worst) {
  Duration largest{-1};
  for (const JobRecord& r : repetition.trace.jobs) {
    if (worst.latency == Latency::response && r.outcome == Outcome::ran && r.job.task == worst.number)
      largest = std::max(largest, r.response_time());
  }
  for (const ChainRecord& c : repetition.trace.chains) {
    if (worst.latency == Latency::response || c.chain != worst.number) continue;
    largest = std::max(largest, c.latency(worst.latency).value_or(largest));
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
  write_graph(common.graph, graph, {}, program::write_with_folder);
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
    const bool of_task = worst.latency == Latency::response;
    const std::string& name = of_task ? tasks.set[worst.number].name : graph.chains[worst.number].name;
    const std::string subject = program::concat(to_string(worst.latency), " ", name);
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
    write(run.string() + ".csv",
          list_of(times.given(), tasks.set, repetition.trace, graph.platform.delivery_delay));
    store(common, run, static_cast<double>(ms) / 1000);
    lines += program::concat("Witness: ", program::fixed(to_ms(Duration(worst.value_ns)), 6), " ms, ",
                             run.string(), "\n");
  }
  return lines;
}

}  // namespace hotpath::guarantees
