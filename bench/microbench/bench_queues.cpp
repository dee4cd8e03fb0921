// SPDX-License-Identifier: Apache-2.0
#include "microbench/bench_queues.hpp"

#include <algorithm>
#include <array>
#include <queue>
#include <random>

#include "hotpath/core/priority_events_queue.hpp"
#include "hotpath/core/simple_events_queue.hpp"
#include "microbench/scheduler_cycles.hpp"

namespace hotpath::gbench {

namespace {

/// Jobs by absolute deadline.
struct KeyedJob {
  PriorityKey key;
  Job job;
  bool operator<(const KeyedJob& other) const { return other.key < key; }
};

/// Random distances from one deadline of a task to the next.
class Distances {
 public:
  explicit Distances(std::int64_t ready) {
    std::mt19937 random(5);
    std::uniform_int_distribution<std::int64_t> distance(0, 2000 * ready);
    for (Duration& d : distances_) d = Duration(distance(random));
  }
  Duration next() { return distances_[at_++ % distances_.size()]; }

 private:
  std::array<Duration, 4096> distances_;
  std::size_t at_ = 0;
};

PriorityKey key_of(const Job& job) { return {to_ns(job.deadline), job.task}; }

/// The yardsticks' and the queues' common experiment: of `ready` jobs the first leaves, and comes back with a
/// later deadline.
template <class Queue>
void hold(benchmark::State& state, Queue queue) {
  Distances distances(state.range(0));
  for (TaskId id = 0; id < static_cast<TaskId>(state.range(0)); ++id) {
    Job job;
    job.task = id;
    job.deadline = Time{} + distances.next();
    queue.push(job);
  }
  for (auto _ : state) {
    Job job = queue.pop();
    job.deadline += distances.next();
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
  std::vector<KeyedJob> jobs;  // the first to run is the last element
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

PriorityEventsQueue edf_queue(std::int64_t tasks) {
  return PriorityEventsQueue(
      PriorityOrder(task_set(tasks, TaskKind::timer), Policy::edf, SubscriptionRule::inherit, Ties::lifo));
}

}  // namespace

void register_queues(std::int64_t most, double min_time) {
  const auto yardstick = [=](const char* name, auto run) {
    benchmark::RegisterBenchmark(name, run)
        ->RangeMultiplier(10)
        ->Range(1, most)
        ->MinTime(min_time)
        ->Complexity();
  };
  yardstick("push_pop/std::priority_queue_of_keys/ready",
            [](benchmark::State& s) { hold(s, StandardQueueOfKeys{}); });
  yardstick("push_pop/std::priority_queue/ready",
            [](benchmark::State& s) { hold(s, StandardQueueOfJobs{}); });
  yardstick("push_pop/sorted_vector/ready", [](benchmark::State& s) { hold(s, SortedVector{}); });
  yardstick("push_pop/SimpleEventsQueue/ready", [](benchmark::State& s) { hold(s, SimpleEventsQueue{}); });
  yardstick("push_pop/PriorityEventsQueue/ready",
            [](benchmark::State& s) { hold(s, edf_queue(s.range(0))); });
}

}  // namespace hotpath::gbench
