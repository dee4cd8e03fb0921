// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_workload.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>

#include "hotpath/core/exploration.hpp"

namespace hotpath {

void SimulatedMessage::give_back() { unused_->push_back(this); }

Platform make_platform(const Graph& graph, const ExecutorEntry& executor) {
  Platform p = graph.platform;
  p.raised_releaser = graph.platform.timer_thread == TimerThread::raised;
  if (graph.platform.timer_thread == TimerThread::by_executor)
    p.raised_releaser = default_platform(executor).raised_releaser;
  p.other_entities = kEntitiesOfANode * static_cast<std::uint32_t>(graph.nodes.size());
  p.wall_clock_work = graph.work == WorkMode::wall;
  return p;
}

namespace {

/// By task: the entries of the sources of all chains whose sinks data of the task can reach.
std::vector<std::vector<TaskId>> sources_of_chains(const GraphTasks& tasks, const SimulatedHistory& history,
                                                   const std::vector<ChainIndex>& chains) {
  std::vector<std::vector<TaskId>> upstream(tasks.set.size()), sources(tasks.set.size());
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    for (const TaskId next : tasks.downstream(id)) upstream[next].push_back(id);
  }
  for (std::uint32_t c = 0; c < chains.size(); ++c) {
    const ChainIndex& chain = chains[c];
    for (const TaskId id : reached_from(chain.sink_tasks, [&](TaskId to) { return upstream[to]; }))
      for (std::size_t s = 0; s < chain.sources.size(); ++s)
        sources[id].push_back(history.entry(c, s, chain.sources[s]));
  }
  return sources;
}

}  // namespace

GraphWorkload::GraphWorkload(const Graph& graph, const GraphTasks& tasks, const ExecutionTimes& times,
                             std::vector<ChainObservation>* observations)
    : tasks_(tasks),
      times_(times),
      observations_(observations),
      structure_(structure_of(graph, tasks)),
      unread_(tasks.set.size()) {
  for (const Node& node : graph.nodes) nodes_.push_back(std::make_shared<Logic>(node, structure_->history));
}

std::shared_ptr<const GraphWorkload::Structure> GraphWorkload::structure_of(const Graph& graph,
                                                                            const GraphTasks& tasks) {
  auto all = std::make_shared<Structure>();
  all->history = SimulatedHistory(ChainLanes(graph, tasks));
  all->chains = index_chains(graph, tasks);
  all->ends.resize(tasks.set.size());
  for (std::uint32_t c = 0; c < all->chains.size(); ++c) {
    for (const TaskId id : all->chains[c].sink_tasks) all->ends[id].push_back(c);
  }
  all->sources = sources_of_chains(tasks, all->history, all->chains);
  all->sources_of_nodes.resize(graph.nodes.size());
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    std::vector<TaskId>& of_node = all->sources_of_nodes[tasks.origin[id].node];
    of_node.insert(of_node.end(), all->sources[id].begin(), all->sources[id].end());
  }
  return all;
}

void GraphWorkload::describe(const SimulatedSample& sample, const std::vector<TaskId>& sources,
                             StateWords& words) const {
  words.add(sample ? -2 : -1);
  if (!sample) return;
  for (const Stat& stat : (*sample).history()) {
    if (std::find(sources.begin(), sources.end(), stat.task) == sources.end()) continue;
    const bool lane = ChainLanes::is_lane(stat.task);
    if (lane) {
      words.add(stat.task);
      words.add((*sample).history().back().task);  // decides where it goes on
    }
    const TaskId source = lane ? structure_->history.lanes().source_of(stat.task) : stat.task;
    const Task& timer = tasks_.set[source];
    words.add_data({{source, stat.sequence}},
                   Time{} + timer.phase + timer.period * static_cast<std::int64_t>(stat.sequence));
  }
}

void GraphWorkload::describe(StateWords& words) const {
  for (std::size_t node = 0; node < nodes_.size(); ++node) {
    nodes_[node]->visit_state(
        [&](std::uint32_t number) { words.add(number); },
        [&](const SimulatedSample& sample) { describe(sample, structure_->sources_of_nodes[node], words); });
  }
  for (TaskId id = 0; id < unread_.size(); ++id) {
    for (const Unread& unread : unread_[id]) {
      words.add(id);
      describe(unread.sample, structure_->sources[id], words);
      if (with_publications_) describe_publication(unread.parent, words);
    }
  }
  for (const OnTheWay& message : on_the_way_)
    describe(message.sample, structure_->sources[message.parent.task], words);
}

void GraphWorkload::describe(const Job& job, StateWords& words) const {
  const Running& running = *std::ranges::find(running_, job.ref(), &Running::ref);
  words.add(running.works ? 1 : 0);
  for (const auto& message : running.messages) words.add(message.publication);
  describe(running.own, structure_->sources[job.task], words);
  for (const SimulatedSample& sample : running.taken) describe(sample, structure_->sources[job.task], words);
  words.add(-3);
}

Duration GraphWorkload::start(const Job& job, Time now) {
  const TaskOrigin& origin = tasks_.origin[job.task];
  if (busy_ == running_.size()) running_.emplace_back();
  Running& running = running_[busy_++];
  SimulatedSample sample = origin.input ? take(job.task, job.sequence) : SimulatedSample();
  node_of(job.task).start(origin.callback, job.ref(), std::move(sample), now, running);
  const Duration time = running.works ? times_.of(job) : Duration{};
  running.early = std::ranges::any_of(running.messages, [](const auto& message) { return message.at < 1; });
  if (!running.early) return time;
  running.time = time;
  running.done = Duration{};
  running.published.assign(running.messages.size(), false);
  return running.done = next_instant(running);
}

std::span<const TaskId> GraphWorkload::finish(const Job& job, const Task&, Time) {
  const auto i =
      static_cast<std::size_t>(std::ranges::find(running_, job.ref(), &Running::ref) - running_.begin());
  assert(i < busy_ && "only a started job can finish");
  publish_due(running_[i]);
  if (rest_) return reached_;
  running_[i].clear();
  if (i != --busy_) std::swap(running_[i], running_[busy_]);
  return reached_;
}

void GraphWorkload::publish(Running& job, std::size_t index) {
  SimulatedMessage& message = pool_->take();
  SimulatedSample sample(message);
  node_of(job.ref.task).finish(job, index, message);
  observe(message, job);
  const std::vector<TaskId>& readers = tasks_.readers[job.ref.task][job.messages[index].publication];
  if (!readers.empty()) on_the_way_.push_back({job.ref, std::move(sample), &readers, readers.size()});
  reached_.insert(reached_.end(), readers.begin(), readers.end());
}

Duration GraphWorkload::instant_of(const Running& job, std::size_t message) const {
  return Duration(std::llround(job.messages[message].at * static_cast<double>(job.time.count())));
}

Duration GraphWorkload::next_instant(const Running& job) const {
  Duration next = job.time;
  for (std::size_t i = 0; i < job.messages.size(); ++i)
    if (!job.published[i]) next = std::min(next, instant_of(job, i));
  return next;
}

void GraphWorkload::publish_due(Running& job) {
  rest_.reset();
  reached_.clear();
  if (job.own && tasks_.readers[job.ref.task].empty()) observe(*job.own, job);
  for (std::size_t i = 0; i < job.messages.size(); ++i) {
    if (job.early && (job.published[i] || instant_of(job, i) > job.done)) continue;
    if (job.early) job.published[i] = true;
    publish(job, i);
  }
  if (!job.early || job.done == job.time) return;
  const Duration next = next_instant(job);
  rest_ = next - std::exchange(job.done, next);
}

void GraphWorkload::delivered(TaskId subscription, std::uint64_t sequence, const JobRef& parent) {
  const auto message = std::ranges::find_if(on_the_way_, [&](const OnTheWay& m) {
    return m.parent == parent && std::ranges::count(*m.readers, subscription) > 0;
  });
  assert(message != on_the_way_.end() && "only a published message can arrive");
  if (--message->deliveries > 0) {
    unread_[subscription].push_back({sequence, message->sample, parent});
  } else {
    unread_[subscription].push_back({sequence, std::move(message->sample), parent});
    on_the_way_.erase(message);
  }
}

void GraphWorkload::overwritten(TaskId subscription, std::uint64_t sequence) { take(subscription, sequence); }

SimulatedSample GraphWorkload::take(TaskId subscription, std::uint64_t sequence) {
  auto& unread = unread_[subscription];
  const auto entry =
      std::find_if(unread.begin(), unread.end(), [&](const Unread& u) { return u.sequence == sequence; });
  assert(entry != unread.end() && "only an unread sample can be taken");
  SimulatedSample sample = std::move(entry->sample);
  unread.erase(entry);
  return sample;
}

void GraphWorkload::observe(const SimulatedMessage& message, Activation<SimulatedMessages>& job) {
  const std::vector<std::uint32_t>& ends = structure_->ends[job.ref.task];
  if (observations_ == nullptr || ends.empty()) return;
  observe_chains(structure_->history, message, structure_->chains, ends, job,
                 [this](const ChainObservation& observation) { observations_->push_back(observation); });
}

Trace working_jobs(const GraphTasks& tasks, const Trace& trace) {
  // A job that waits for sets has worked if it published; then some subscription has a record of
  // its message.
  std::set<std::pair<TaskId, std::uint64_t>> published;
  for (const JobRecord& r : trace.jobs) published.emplace(r.job.parent.task, r.job.parent.sequence);
  const auto shows_work = [&](TaskId id) {
    return tasks.callbacks[id].waits_for_sets() && !tasks.set[id].feeds.empty();
  };
  Trace working;
  working.executor = trace.executor;
  working.repetition = trace.repetition;
  std::vector<bool> has_times(tasks.set.size(), false);
  for (const JobRecord& r : trace.jobs) {
    const TaskId id = r.job.task;
    if (r.outcome != Outcome::ran) continue;
    if (shows_work(id) && published.count({id, r.job.sequence}) == 0) continue;
    working.jobs.push_back(r);
    has_times[id] = true;
  }
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (has_times[id] || !shows_work(id)) continue;
    TaskId other = 0;
    while (other < tasks.set.size() &&
           (!has_times[other] || tasks.callbacks[other].publishes != tasks.callbacks[id].publishes ||
            tasks.origin[other].node != tasks.origin[id].node)) {
      ++other;
    }
    for (std::size_t i = 0, measured = working.jobs.size(); i < measured; ++i) {
      if (working.jobs[i].job.task != other) continue;
      working.jobs.push_back(JobRecord(working.jobs[i]));
      working.jobs.back().job.task = id;
    }
  }
  return working;
}

}  // namespace hotpath
