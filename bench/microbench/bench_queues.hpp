// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <queue>
#include <random>

#include "hotpath/core/priority_events_queue.hpp"
#include "hotpath/core/simple_events_queue.hpp"
#include "microbench/scheduler_cycles.hpp"

namespace hotpath::gbench {

/// Jobs by absolute deadline.
struct KeyedJob {
  PriorityKey key;
  Job job;
  bool operator<(const KeyedJob& other) const { return other.key < key; }
};

inline PriorityKey key_of(const Job& job) { return {to_ns(job.deadline), job.task}; }

/// The yardsticks' and the queues' common experiment: of `ready` jobs the first leaves, and comes back with a
/// later deadline.
template <class Queue>
void hold(benchmark::State& state, Queue queue) {
  // Random distances from one deadline of a task to the next.
  std::array<Duration, 4096> distances;
  std::mt19937 random(5);
  std::uniform_int_distribution<std::int64_t> distance(0, 2000 * state.range(0));
  for (Duration& d : distances) d = Duration(distance(random));
  std::size_t at = 0;
  const auto next = [&] { return distances[at++ % distances.size()]; };
  for (TaskId id = 0; id < static_cast<TaskId>(state.range(0)); ++id) {
    Job job;
    job.task = id;
    job.deadline = Time{} + next();
    queue.push(job);
  }
  for (auto _ : state) {
    Job job = queue.pop();
    job.deadline += next();
    benchmark::DoNotOptimize(job);
    queue.push(job);
  }
  state.SetComplexityN(state.range(0));
}

struct StandardQueueOfJobs {
  std::priority_queue<KeyedJob> queue;
  void push(const Job& job) { queue.push({key_of(job), job}); }
  Job pop() {
    const Job job = queue.top().job;
    static_cast<void>(queue.pop());
    return job;
  }
};

/// The least that there is to do: keys without jobs.
struct StandardQueueOfKeys {
  std::priority_queue<PriorityKey, std::vector<PriorityKey>, std::greater<>> queue;
  void push(const Job& job) { queue.push(key_of(job)); }
  Job pop() {
    Job job;
    job.deadline = from_ns(queue.top().priority);
    job.task = static_cast<TaskId>(queue.top().tie);
    static_cast<void>(queue.pop());
    return job;
  }
};

struct SortedVector {
  std::vector<KeyedJob> jobs;  // the first to run is the last
  void push(const Job& job) {
    const KeyedJob keyed{key_of(job), job};
    jobs.insert(std::lower_bound(jobs.begin(), jobs.end(), keyed), keyed);
  }
  Job pop() {
    const Job job = jobs.back().job;
    jobs.pop_back();
    return job;
  }
};

/// Events queues of up to `most` jobs, with standard containers as yardsticks. `min_time`: seconds of each.
inline void register_queues(std::int64_t most, double min_time) {
  const auto add = [=](const std::string& name, auto make_queue) {
    benchmark::RegisterBenchmark(("push_pop/" + name + "/ready").c_str(),
                                 [=](benchmark::State& s) { hold(s, make_queue(s.range(0))); })
        ->RangeMultiplier(10)
        ->Range(1, most)
        ->MinTime(min_time)
        ->Complexity();
  };
  add("std::priority_queue_of_keys", [](auto) { return StandardQueueOfKeys{}; });
  add("std::priority_queue", [](auto) { return StandardQueueOfJobs{}; });
  add("sorted_vector", [](auto) { return SortedVector{}; });
  add("SimpleEventsQueue", [](auto) { return SimpleEventsQueue{}; });
  add("PriorityEventsQueue", [](std::int64_t tasks) {
    return PriorityEventsQueue(
        PriorityOrder(task_set(tasks, TaskKind::timer), Policy::edf, SubscriptionRule::inherit, Ties::lifo));
  });
}

}  // namespace hotpath::gbench
