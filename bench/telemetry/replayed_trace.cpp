// SPDX-License-Identifier: Apache-2.0
#include "telemetry/replayed_trace.hpp"

#include <algorithm>
#include <map>

#include "program/csv_rows.hpp"
#include "program/errors.hpp"
#include "setup/run_setup.hpp"

namespace hotpath {

namespace {

/// A whole repetition ends as planned; that of an interrupted run with its last record.
Time end_of(const nlohmann::json& facts, const Trace& trace) {
  const Time planned =
      Time{} + seconds(facts.at("warm_up_s").get<double>() + facts.at("duration_s").get<double>());
  const nlohmann::json& last = facts.at("runs").back();
  const bool interrupted = facts.at("partial").get<bool>() && last.at("executor") == trace.executor &&
                           last.at("repetition") == trace.repetition;
  if (!interrupted) return planned;
  Time end{};
  for (const JobRecord& r : trace.jobs) end = std::max({end, r.start, r.finish, r.job.timestamp});
  return std::min(end + Duration(1), planned);
}

/// The records of jobs that end a chain, by sequence; where several sink tasks have one, the last to start.
std::map<std::uint64_t, const JobRecord*> sink_jobs(const Trace& trace, const MeasuredChain& chain) {
  std::map<std::uint64_t, const JobRecord*> jobs;
  for (const JobRecord& r : trace.jobs) {
    const auto& sinks = chain.sink_tasks;
    const bool started = r.outcome == Outcome::ran || r.outcome == Outcome::running;
    if (!started || std::find(sinks.begin(), sinks.end(), r.job.task) == sinks.end()) continue;
    const JobRecord*& found = jobs[r.job.sequence];
    if (found == nullptr || r.start > found->start) found = &r;
  }
  return jobs;
}

std::vector<ReplayedChain> read_chains(const std::filesystem::path& file, const Trace& trace,
                                       const Graph& graph, const GraphTasks& tasks) {
  const std::vector<MeasuredChain> chains = measured_chains(graph, tasks);
  std::map<std::string, std::uint32_t> index;
  std::vector<std::map<std::uint64_t, const JobRecord*>> sinks;
  for (const MeasuredChain& chain : chains) {
    index[chain.name] = static_cast<std::uint32_t>(sinks.size());
    sinks.push_back(sink_jobs(trace, chain));
  }
  std::vector<ReplayedChain> replayed;
  for (const CsvRow& row : read_csv(file)) {
    if (row.text("executor") != trace.executor || row.number("repetition") != trace.repetition) continue;
    const auto chain = index.find(row.text("chain"));
    if (chain == index.end()) {
      throw UsageError(file.string() + ": the graph has no chain `" + row.text("chain") +
                       "`; name the run's own with --graph");
    }
    ReplayedChain& r = replayed.emplace_back();
    r.record.chain = chain->second;
    r.record.sequence = static_cast<std::uint64_t>(row.number("sequence"));
    r.record.hot_path_latency = Duration(static_cast<std::int64_t>(row.number("hot_path_latency_ns")));
    if (!row.text("end_to_end_latency_ns").empty()) {
      r.record.end_to_end_latency = Duration(static_cast<std::int64_t>(row.number("end_to_end_latency_ns")));
    }
    const auto sink = sinks[chain->second].find(r.record.sequence);
    if (sink == sinks[chain->second].end()) {
      throw UsageError(file.string() + ": jobs.csv has no job " + row.text("sequence") +
                       " of the sink of chain `" + row.text("chain") + "`; the files are not of one run");
    }
    r.sink_start = sink->second->start;
    r.sink_finish = sink->second->outcome == Outcome::ran ? sink->second->finish : kNever;
  }
  std::stable_sort(replayed.begin(), replayed.end(), [](const ReplayedChain& a, const ReplayedChain& b) {
    return a.sink_finish < b.sink_finish;
  });
  return replayed;
}

}  // namespace

ReplayedTrace replayed_trace(const MeasuredRun& run, const Graph& graph, const std::string& executor,
                             std::uint32_t repetition) {
  ReplayedTrace replayed;
  replayed.tasks = make_tasks(graph);
  const std::vector<Duration> phases = run.first_timestamps(replayed.tasks.set, executor, repetition);
  for (TaskId id = 0; id < phases.size(); ++id) replayed.tasks.set.tasks[id].phase = phases[id];

  const Trace& trace = run.trace(executor, repetition);
  replayed.end = end_of(run.facts(), trace);
  replayed.published.resize(replayed.tasks.set.size());
  for (const JobRecord& r : trace.jobs) {
    if (r.outcome == Outcome::ran || r.outcome == Outcome::overwritten) replayed.jobs.push_back(r);
    if (replayed.tasks.set[r.job.task].kind == TaskKind::subscription && r.outcome != Outcome::empty) {
      replayed.published[r.job.task].push_back(r.job.timestamp);
    }
  }
  std::stable_sort(replayed.jobs.begin(), replayed.jobs.end(),
                   [](const JobRecord& a, const JobRecord& b) { return known_at(a) < known_at(b); });
  for (auto& instants : replayed.published) std::sort(instants.begin(), instants.end());
  replayed.chains = read_chains(run.folder() / "chains.csv", trace, graph, replayed.tasks);
  return replayed;
}

}  // namespace hotpath
