// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_workload.hpp"

#include <algorithm>
#include <cassert>
#include <set>

#include "hotpath/reference_system/observe.hpp"

namespace hotpath {

Platform make_platform(const Graph& graph, const ExecutorEntry& executor) {
  const GraphPlatform& given = graph.platform;
  Platform p = default_platform(executor);
  p.cores = given.cores;
  if (given.timer_thread != TimerThread::by_executor) {
    p.raised_releaser = given.timer_thread == TimerThread::raised;
  }
  p.release_cost = given.release_cost;
  p.pass_cost = given.pass_cost;
  p.dispatch_cost = given.dispatch_cost;
  p.wait_cost = given.wait_cost;
  p.wait_cost_per_entity = given.wait_cost_per_entity;
  p.other_entities = kEntitiesOfANode * static_cast<std::uint32_t>(graph.nodes.size());
  p.wake_up_latency = given.wake_up;
  p.delivery_delay = given.delivery_delay;
  p.wall_clock_work = graph.work == WorkMode::wall;
  return p;
}

const SimulatedHistory GraphWorkload::kHistory;

GraphWorkload::GraphWorkload(const Graph& graph, const GraphTasks& tasks, const ExecutionTimes& times,
                             std::vector<ChainObservation>* observations)
    : tasks_(tasks),
      times_(times),
      observations_(observations),
      chains_(index_chains(graph)),
      unread_(tasks.set.size()) {
  for (std::uint32_t i = 0; i < graph.nodes.size(); ++i) {
    SimulatedNode& node = nodes_.emplace_back(i, graph.nodes[i]);
    for (std::uint32_t c = 0; c < chains_.size(); ++c) {
      if (chains_[c].sink == i) node.sink_of.push_back(c);
    }
  }
}

Duration GraphWorkload::start(const Job& job, Time now) {
  const TaskOrigin& origin = tasks_.origin[job.task];
  Running& running = running_.emplace_back();
  running.job = job.ref();
  NodeLogic<SimulatedMessages>& logic = nodes_[origin.node].logic;
  if (origin.input) {
    logic.start_subscription(*origin.input, take(job.task, job.sequence), now, running.activation);
  } else {
    logic.start_timer(now, running.activation);
  }
  return running.activation.works ? times_.of(job) : Duration{};
}

bool GraphWorkload::finish(const Job& job, Time) {
  const auto running =
      std::find_if(running_.begin(), running_.end(), [&](const Running& r) { return r.job == job.ref(); });
  assert(running != running_.end() && "a job finishes that has not started");
  const bool published = complete(job, running->activation);
  if (running != running_.end() - 1) *running = std::move(running_.back());
  running_.pop_back();
  return published;
}

bool GraphWorkload::complete(const Job& job, Activation<SimulatedMessages>& activation) {
  if (!activation.works) return false;

  const TaskOrigin& origin = tasks_.origin[job.task];
  SimulatedNode& node = nodes_[origin.node];
  if (!activation.publishes) {
    if (activation.held[0]) observe(node, *activation.held[0], job, activation.start);
    return false;
  }
  SimulatedMessage& message = pool_.take();
  SimulatedSample sample(pool_, message);
  node.logic.finish(node.logic.output(origin.input.value_or(0)), activation, message);
  observe(node, message, job, activation.start);
  if (const std::size_t readers = tasks_.set[job.task].feeds.size(); readers > 0) {
    on_the_way_.push_back({job.ref(), std::move(sample), readers});
  }
  return true;
}

void GraphWorkload::delivered(TaskId subscription, std::uint64_t sequence, JobRef parent) {
  const auto message = std::find_if(on_the_way_.begin(), on_the_way_.end(),
                                    [&](const OnTheWay& m) { return m.parent == parent; });
  assert(message != on_the_way_.end() && "a message arrives that nobody published");
  if (--message->deliveries > 0) {
    unread_[subscription].push_back({sequence, message->sample});
  } else {
    unread_[subscription].push_back({sequence, std::move(message->sample)});
    on_the_way_.erase(message);
  }
}

void GraphWorkload::overwritten(TaskId subscription, std::uint64_t sequence) { take(subscription, sequence); }

SimulatedSample GraphWorkload::take(TaskId subscription, std::uint64_t sequence) {
  auto& unread = unread_[subscription];
  const auto found =
      std::find_if(unread.begin(), unread.end(), [&](const Unread& u) { return u.sequence == sequence; });
  assert(found != unread.end() && "a sample is taken that is not there");
  SimulatedSample sample = std::move(found->sample);
  unread.erase(found);
  return sample;
}

void GraphWorkload::observe(const SimulatedNode& node, const SimulatedMessage& message, const Job& job,
                            Time start) {
  if (observations_ == nullptr) return;
  for (const std::uint32_t chain : node.sink_of) {
    ChainObservation observation;
    observation.chain = chain;
    if (observe_chain(kHistory, message, chains_[chain], job.ref(), start, observation)) {
      observations_->push_back(observation);
    }
  }
}

Trace working_jobs(const Graph& graph, const GraphTasks& tasks, const Trace& trace) {
  // A fusion's job worked if it published, and then some subscription has a record of its message.
  std::set<std::pair<TaskId, std::uint64_t>> published;
  for (const JobRecord& r : trace.jobs) published.emplace(r.job.parent.task, r.job.parent.sequence);
  const auto of_heard_fusion = [&](TaskId id) {
    return graph.nodes[tasks.origin[id].node].type == NodeType::fusion && !tasks.set[id].feeds.empty();
  };
  Trace working;
  working.executor = trace.executor;
  working.repetition = trace.repetition;
  std::vector<bool> has_times(tasks.set.size(), false);
  for (const JobRecord& r : trace.jobs) {
    const TaskId id = r.job.task;
    if (r.outcome != Outcome::ran) continue;
    if (of_heard_fusion(id) && published.count({id, r.job.sequence}) == 0) continue;
    working.jobs.push_back(r);
    has_times[id] = true;
  }
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (has_times[id] || !of_heard_fusion(id)) continue;
    for (TaskId other = 0; other < tasks.set.size(); ++other) {
      if (!has_times[other] || tasks.origin[other].node != tasks.origin[id].node) continue;
      const std::size_t measured = working.jobs.size();
      for (std::size_t i = 0; i < measured; ++i) {
        if (working.jobs[i].job.task != other) continue;
        JobRecord copy = working.jobs[i];
        copy.job.task = id;
        working.jobs.push_back(copy);
      }
      break;
    }
  }
  return working;
}

}  // namespace hotpath
