// SPDX-License-Identifier: Apache-2.0
#include "results/measured_run.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "hotpath/core/trace_csv.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/errors.hpp"
#include "setup/executor_spec.hpp"
#include "simulated/own_times.hpp"

namespace hotpath {

using nlohmann::json;

namespace {

std::string named(const std::string& executor, std::uint32_t repetition) {
  return executor + " (repetition " + std::to_string(repetition) + ")";
}

}  // namespace

MeasuredRun::MeasuredRun(const std::filesystem::path& folder, std::string option)
    : folder_(folder), option_(std::move(option)) {
  std::ifstream in(folder_ / "run.json");
  if (!in) fail("there is no run.json; name the folder of a run, as written by `hotpath run`");
  try {
    facts_ = json::parse(in);
    cores_ = facts_.contains("cpus") ? static_cast<unsigned>(facts_.at("cpus").size())
                                     : facts_.at("platform").at("cores").get<unsigned>();
    for (const json& run : facts_.at("runs")) {
      Start& start = starts_.emplace_back();
      start.executor = run.at("executor").get<std::string>();
      start.repetition = run.at("repetition").get<std::uint32_t>();
      for (const auto& [task, ms] : run.at("first_timestamps_ms").items()) {
        start.first_timestamps_ms.emplace_back(task, ms.get<double>());
      }
    }
  } catch (const json::exception& error) {
    fail(std::string("its run.json is not one of `hotpath run`: ") + error.what());
  }
}

std::vector<Duration> MeasuredRun::first_timestamps(const TaskSet& set, const std::string& executor,
                                                    std::uint32_t repetition) const {
  std::vector<std::string> there_are;
  for (const Start& start : starts_) {
    there_are.push_back(named(start.executor, start.repetition));
    if (start.executor != executor || start.repetition != repetition) continue;
    std::vector<Duration> first(set.size());
    std::size_t timers = 0;
    for (TaskId id = 0; id < set.size(); ++id) {
      if (set[id].kind != TaskKind::timer) continue;
      ++timers;
      const auto found = std::find_if(start.first_timestamps_ms.begin(), start.first_timestamps_ms.end(),
                                      [&](const auto& f) { return f.first == set[id].name; });
      if (found == start.first_timestamps_ms.end()) {
        fail("it has no first timestamp for timer " + set[id].name + "; was it of another graph?");
      }
      first[id] = from_ms(found->second);
    }
    if (timers != start.first_timestamps_ms.size()) {
      fail("it has first timestamps for " + std::to_string(start.first_timestamps_ms.size()) +
           " timers, the graph has " + std::to_string(timers) + "; was it of another graph?");
    }
    return first;
  }
  fail_missing(executor, repetition, there_are);
}

void MeasuredRun::load_jobs(const TaskSet& set) {
  const std::filesystem::path file = folder_ / "jobs.csv";
  std::ifstream in(file);
  if (!in) fail("there is no jobs.csv; name the folder of a whole run");
  try {
    traces_ = read_jobs_csv(in, set, file.string());
  } catch (const TraceCsvError& error) {
    throw UsageError(option_ + ": " + error.what());
  }
}

const Trace& MeasuredRun::trace(const std::string& executor, std::uint32_t repetition) const {
  std::vector<std::string> there_are;
  for (const Trace& trace : traces_) {
    there_are.push_back(named(trace.executor, trace.repetition));
    if (trace.executor == executor && trace.repetition == repetition) return trace;
  }
  fail_missing(executor, repetition, there_are);
}

std::unique_ptr<ExecutionTimes> MeasuredRun::execution_times(const Graph& graph, const GraphTasks& tasks,
                                                             const std::string& executor,
                                                             std::uint32_t repetition) const {
  const Trace& measured = trace(executor, repetition);
  // Nodes that work until an instant of the clock count time in which they are displaced as work.
  if (graph.work == WorkMode::wall) {
    return std::make_unique<ReplayedTimes>(tasks.set, working_jobs(graph, tasks, measured));
  }
  const bool raised = parse_executor(executor, {}).entry->traits.raises_timer_thread;
  return std::make_unique<ReplayedTimes>(
      tasks.set, working_jobs(graph, tasks, with_own_times(measured, cores_, raised)));
}

void MeasuredRun::fail(const std::string& what) const {
  throw UsageError(option_ + " " + folder_.string() + ": " + what);
}

void MeasuredRun::fail_missing(const std::string& executor, std::uint32_t repetition,
                               const std::vector<std::string>& there_are) const {
  std::string list;
  for (const std::string& name : there_are) list += (list.empty() ? "" : ", ") + name;
  fail(named(executor, repetition) + " did not run there; " +
       (list.empty() ? "nothing did" : "there are " + list));
}

}  // namespace hotpath
