// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>

#include "hotpath/analysis/exact.hpp"
#include "hotpath/analysis/nasri_2017.hpp"
#include "timer_responses.hpp"

namespace hotpath {

namespace {

using A = Assumption;

/// A timer followed by its subscriptions in order.
struct Sequence {
  std::vector<TaskId> tasks;
};

[[noreturn]] void refuse(const std::string& task, const char* problem) {
  throw AnalysisError("the schedule-abstraction graph covers only sequences of subscriptions, and " + task +
                      " " + problem);
}

/// If a subscription inherits its level, or goes first, no job of its timer starts while it is
/// pending. Therefore no sample is overwritten, and two subscriptions of one level are never
/// pending together.
std::vector<Sequence> sequences(const GraphTopology& topology) {
  std::vector<Sequence> all;
  for (const TaskId timer : topology.timers()) {
    Sequence sequence{{timer}};
    for (TaskId id = timer;;) {
      const std::vector<TaskId>& feeds = topology.set()[id].feeds;
      const Task& task = topology.set()[id];
      if (topology.join_of(id) != nullptr || feeds.size() > 1 || topology.publishers(id).size() > 1) {
        refuse(task.name, "feeds, or is fed by, more than one task");
      }
      if (topology.graph().every[id] > 1) refuse(task.name, "does not publish with every job");
      if (id != timer && task.priority) refuse(task.name, "has a priority of its own");
      if (feeds.empty()) break;
      id = feeds.front();
      sequence.tasks.push_back(id);
    }
    all.push_back(std::move(sequence));
  }
  return all;
}

/// Adds the successors of the timers' jobs. Each stage of a sequence has its own task number,
/// subscriptions before timers as at equal priority.
std::vector<SagJob> with_subscriptions(const std::vector<SagJob>& timers, const std::vector<Sequence>& of,
                                       const BoundedSystem& system) {
  const TaskSet& set = system.graph.set;
  const GraphOrder order = priority_ranks(system);
  const bool by_deadline = system.executor.traits.policy == Policy::edf;
  const bool first = system.scheduling.rule == SubscriptionRule::first;
  std::vector<SagJob> jobs;
  for (const SagJob& timer : timers) {
    std::optional<std::size_t> before;
    for (const TaskId id : of[timer.task].tasks) {
      SagJob job = timer;
      job.task = set[id].kind == TaskKind::timer ? set.size() + id : id;
      job.cost_min = set[id].bcet.count();
      job.cost_max = set[id].wcet.count();
      const bool timer_job = set[id].kind == TaskKind::timer;
      job.priority = !by_deadline          ? order.rank[id]
                     : first && !timer_job ? std::numeric_limits<std::int64_t>::min()
                                           : timer.deadline;
      job.predecessor = before;
      before = jobs.size();
      jobs.push_back(job);
    }
  }
  return jobs;
}

/// One task per sequence, so that hyperperiod and utilisation include all jobs.
PeriodicTasks whole_sequences(const std::vector<Sequence>& all, const TaskSet& set) {
  PeriodicTasks tasks;
  for (const Sequence& sequence : all) {
    const Task& timer = set[sequence.tasks.front()];
    PeriodicTask& task = tasks.emplace_back();
    task = {.name = timer.name,
            .id = sequence.tasks.front(),
            .period = timer.period.count(),
            .deadline = timer.deadline.count(),
            .phase = timer.phase.count()};
    for (const TaskId id : sequence.tasks) task.wcet = exact::add(task.wcet, set[id].wcet.count());
  }
  return tasks;
}

void explore(const BoundedSystem& system, GraphBounds& out) {
  const GraphTopology topology(system.graph);
  const TaskSet& set = system.graph.set;
  const std::vector<Sequence> all = sequences(topology);
  const std::vector<SagJob> timers = sag_jobs(whole_sequences(all, set), SagPolicy::edf);
  const std::vector<SagJob> jobs = with_subscriptions(timers, all, system);
  const SagResult result = nasri_2017(jobs);
  if (result.end != SagEnd::complete) {
    throw AnalysisError("the schedule-abstraction graph exceeds the limit of " +
                        std::string(result.end == SagEnd::time_limit ? "time" : "memory"));
  }
  const ResponseTimes response = sag_response_times(jobs, result, 2 * std::size_t{set.size()});
  out.tasks.resize(set.size());
  for (const TaskId timer : topology.timers()) out.tasks[timer] = response[set.size() + timer];
  for (const CallbackGraph::DataChain& chain : system.graph.chains) {
    std::optional<ChainAge>& age = out.chains.emplace_back();
    out.no_chain_bound.emplace_back("its data does not come from a single sequence");
    if (chain.sources.size() != 1 || chain.sinks.size() != 1) continue;
    const TaskId source = chain.sources.front(), sink = chain.sinks.front();
    if (topology.roots(sink) != chain.sources || sink == source || !system.graph.reads[sink].empty())
      continue;
    age = ChainAge{*response[sink], *response[sink], 0, source, sink, kNoTask, {}};
  }
}

}  // namespace

GraphBounds exact_bounds(const BoundedSystem& system, std::uint32_t also_covers) {
  const std::uint32_t covers =
      bits({A::fixed_priorities, A::deadlines, A::subscriptions, A::shifted_phases, A::mixed_deadlines});
  return attempt("Nasri 2017 (exact, for these phases)", assumptions_of(system) & ~covers & ~also_covers,
                 [&](GraphBounds& out) { explore(system, out); });
}

}  // namespace hotpath
