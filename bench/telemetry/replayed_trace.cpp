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

std::vector<ReplayedChain> replayed_chains(const results::StoredRun& run, const Trace& trace,
                                           const Graph& graph) {
  std::map<std::pair<TaskId, std::uint64_t>, const JobRecord*> sinks;  // started jobs, by task and sequence
  for (const ChainRecord& r : trace.chains) sinks[{r.sink, r.sequence}] = nullptr;
  for (const JobRecord& r : trace.jobs) {
    const auto sink = sinks.find({r.job.task, r.job.sequence});
    if (sink != sinks.end() && started(r)) sink->second = &r;
  }
  std::vector<ReplayedChain> replayed;
  for (const ChainRecord& record : trace.chains) {
    const std::string& name = run.chains()[record.chain];
    const auto chain = std::ranges::find(graph.chains, name, &Chain::name);
    if (chain == graph.chains.end()) {
      run.fail("the graph has no chain `" + name + "`; give the run's own graph with --graph");
    }
    ReplayedChain& r = replayed.emplace_back();
    r.record = record;
    r.record.chain = static_cast<std::uint32_t>(chain - graph.chains.begin());
    const JobRecord* const sink = sinks.at({record.sink, record.sequence});
    if (sink == nullptr) {
      run.fail("jobs.csv has no job " + std::to_string(record.sequence) + " of the sink of chain `" + name +
               "`; the files do not belong to one run");
    }
    r.sink_start = sink->start;
    r.sink_finish = sink->outcome == Outcome::ran ? sink->finish : kNever;
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
  replayed.chains = replayed_chains(run, trace, graph);
  return replayed;
}

}  // namespace hotpath::telemetry
