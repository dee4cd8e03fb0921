// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <memory>
#include <numeric>
#include <queue>
#include <random>
#include <vector>

#include "hotpath/core/priority_events_queue.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/core/simple_events_queue.hpp"

namespace hotpath::microbench {

using namespace std::chrono_literals;

/// The numbers below `n` in random order.
inline std::vector<std::uint32_t> shuffled(std::int64_t n, std::uint64_t seed) {
  std::vector<std::uint32_t> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 0U);
  std::shuffle(order.begin(), order.end(), std::mt19937_64(seed));
  return order;
}

/// `n` tasks, each in a separate callback group. One timer is due every microsecond.
inline TaskSet task_set(std::int64_t n, TaskKind kind) {
  const std::vector<std::uint32_t> phase = shuffled(n, 1), urgency = shuffled(n, 2);
  TaskSet set;
  set.groups.assign(static_cast<std::size_t>(n), CallbackGroup::mutually_exclusive);
  for (std::int64_t i = 0; i < n; ++i) {
    Task t;
    t.kind = kind;
    t.group = static_cast<std::uint32_t>(i);
    t.priority = urgency[static_cast<std::size_t>(i)];
    if (kind == TaskKind::timer) {
      t.period = n * 1us;
      t.phase = phase[static_cast<std::size_t>(i)] * 1us;
      t.deadline = urgency[static_cast<std::size_t>(i)] * 1us + 1us;
    }
    set.tasks.push_back(std::move(t));
  }
  return set;
}

/// One scheduler in virtual time, with a microsecond per release.
class Cycle {
 public:
  Decision decide() { return scheduler_->decide(worker_, now_); }
  void finish(const Job& job) { benchmark::DoNotOptimize(scheduler_->finished(worker_, job, now_)); }

 protected:
  Cycle(const ExecutorEntry& executor, std::int64_t tasks, TaskKind kind, Worker worker)
      : scheduler_(executor.make(task_set(tasks, kind), {})), worker_(worker) {
    scheduler_->begin(now_ + 1us);
  }

  const std::unique_ptr<Scheduler> scheduler_;
  const Worker worker_;
  Time now_{};
};

/// Timers become due one after another; `ready` jobs wait all the time.
class TimerCycle : public Cycle {
 public:
  TimerCycle(const ExecutorEntry& executor, std::int64_t tasks, std::int64_t ready)
      : Cycle(executor, tasks, TaskKind::timer, executor.traits.timer_worker()) {
    for (std::int64_t i = 0; i < ready; ++i) release();
  }
  void prepare(std::int64_t) {}
  void release() {
    now_ += 1us;
    const Worker releaser = static_cast<Worker>(scheduler_->workers().size() - 1);
    benchmark::DoNotOptimize(scheduler_->release_timers(releaser, now_));
  }
};

/// Samples arrive for random subscriptions without a sample; `ready` subscriptions always hold one.
/// EDF uses the deadline of the sample, and the other policies the priority of the graph (policy
/// fp).
class SampleCycle : public Cycle {
 public:
  SampleCycle(const ExecutorEntry& executor, std::int64_t tasks, std::int64_t ready)
      : Cycle(executor, tasks, TaskKind::subscription, 0), idle_(shuffled(tasks, 3)) {
    prepare(ready);
    for (std::int64_t i = 0; i < ready; ++i) release();
  }
  void prepare(std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i) {
      std::swap(idle_[random_() % idle_.size()], idle_.back());
      next_.push_back(idle_.back());
      idle_.pop_back();
    }
  }
  void release() {
    now_ += 1us;
    const SampleInfo sample{now_, now_ + (next_.back() % 1024) * 1us, {}};
    benchmark::DoNotOptimize(scheduler_->sample_arrived(next_.back(), sample, now_));
    next_.pop_back();
  }
  void finish(const Job& job) {
    Cycle::finish(job);
    idle_.push_back(job.task);
  }

 private:
  std::vector<std::uint32_t> idle_, next_;
  std::mt19937 random_{4};
};

/// Jobs by absolute deadline.
struct KeyedJob {
  PriorityKey key;
  Job job;
  bool operator<(const KeyedJob& other) const { return other.key < key; }
};

inline PriorityKey key_of(const Job& job) { return {to_ns(job.deadline), job.task}; }

/// The experiment for the queues and their yardstick: the first of `ready` jobs leaves and returns
/// with a later deadline.
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

/// Events queues of up to `most` jobs, with std::priority_queue as yardstick. `min_time`: seconds
/// each.
inline void register_queues(std::int64_t most, double min_time) {
  const auto add = [=](const std::string& name, auto make_queue) {
    benchmark::RegisterBenchmark(("push_pop/" + name + "/ready").c_str(),
                                 [=](benchmark::State& s) { hold(s, make_queue(s.range(0))); })
        ->RangeMultiplier(10)
        ->Range(1, most)
        ->MinTime(min_time)
        ->Complexity();
  };
  add("std::priority_queue", [](auto) { return StandardQueueOfJobs{}; });
  add("SimpleEventsQueue", [](auto) { return SimpleEventsQueue{}; });
  add("PriorityEventsQueue", [](std::int64_t tasks) {
    return PriorityEventsQueue(
        PriorityOrder(task_set(tasks, TaskKind::timer), Policy::edf, SubscriptionRule::inherit, Ties::lifo));
  });
}

}  // namespace hotpath::microbench
