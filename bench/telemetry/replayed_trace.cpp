// SPDX-License-Identifier: Apache-2.0
#include "telemetry/replayed_trace.hpp"

#include <algorithm>
#include <map>

#include "program/errors.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::telemetry {

namespace {

/// A complete repetition ends as planned, an interrupted repetition with its last record.
Time end_of(const results::StoredRun& run, const Trace& trace) {
  const Time planned = Time{} + run.length();
  const results::RepetitionRecord& last = run.record().runs.back();
  const bool interrupted =
      run.record().partial && last.executor == trace.executor && last.repetition == trace.repetition;
  if (!interrupted) return planned;
  Time end{};
  for (const JobRecord& r : trace.jobs) end = std::max({end, r.start, r.finish, r.job.timestamp});
  return std::min(end + Duration(1), planned);
}

/// The records of jobs that end a chain, by sequence. If several sink tasks have a job of a
/// sequence, the last started job.
std::map<std::uint64_t, const JobRecord*> sink_jobs(const Trace& trace, const results::MeasuredChain& chain) {
  std::map<std::uint64_t, const JobRecord*> jobs;
  for (const JobRecord& r : trace.jobs) {
    const auto& sinks = chain.sink_tasks;
    if (!started(r) || std::ranges::find(sinks, r.job.task) == sinks.end()) continue;
    const JobRecord*& last_started = jobs[r.job.sequence];
    if (last_started == nullptr || r.start > last_started->start) last_started = &r;
  }
  return jobs;
}

std::vector<ReplayedChain> replayed_chains(const results::StoredRun& run, const Trace& trace,
                                           const Graph& graph, const GraphTasks& tasks) {
  const std::vector<results::MeasuredChain> chains = setup::measured_chains(graph, tasks);
  std::vector<std::map<std::uint64_t, const JobRecord*>> sinks(chains.size());
  std::ranges::transform(chains, sinks.begin(), [&](const auto& chain) { return sink_jobs(trace, chain); });
  std::vector<ReplayedChain> replayed;
  for (const ChainRecord& record : trace.chains) {
    const std::string& name = run.chains()[record.chain];
    const auto chain = std::ranges::find(chains, name, &results::MeasuredChain::name);
    if (chain == chains.end()) {
      run.fail("the graph has no chain `" + name + "`; give the run's own graph with --graph");
    }
    ReplayedChain& r = replayed.emplace_back();
    r.record = record;
    r.record.chain = static_cast<std::uint32_t>(chain - chains.begin());
    const auto sink = sinks[r.record.chain].find(r.record.sequence);
    if (sink == sinks[r.record.chain].end()) {
      run.fail("jobs.csv has no job " + std::to_string(record.sequence) + " of the sink of chain `" + name +
               "`; the files do not belong to one run");
    }
    r.sink_start = sink->second->start;
    r.sink_finish = sink->second->outcome == Outcome::ran ? sink->second->finish : kNever;
  }
  std::ranges::stable_sort(replayed, {}, &ReplayedChain::sink_finish);
  return replayed;
}

}  // namespace

ReplayedTrace replayed_trace(const results::StoredRun& run, const Graph& graph, const std::string& executor,
                             std::uint32_t repetition) {
  ReplayedTrace replayed;
  replayed.tasks = make_tasks(graph);
  setup::set_phases(replayed.tasks.set, run.first_timestamps(replayed.tasks.set, executor, repetition));

  const Trace& trace = run.trace(executor, repetition);
  replayed.end = end_of(run, trace);
  replayed.published.resize(replayed.tasks.set.size());
  for (const JobRecord& r : trace.jobs) {
    if (r.outcome == Outcome::ran || r.outcome == Outcome::overwritten) replayed.jobs.push_back(r);
    if (replayed.tasks.set[r.job.task].kind == TaskKind::subscription && r.outcome != Outcome::empty) {
      replayed.published[r.job.task].push_back(r.job.timestamp);
    }
  }
  std::ranges::stable_sort(replayed.jobs, {}, known_at);
  for (auto& instants : replayed.published) std::ranges::sort(instants);
  replayed.chains = replayed_chains(run, trace, graph, replayed.tasks);
  return replayed;
}

}  // namespace hotpath::telemetry
