// SPDX-License-Identifier: Apache-2.0
// Costs of the scheduling core without threads: release, decision and finish of one job of 1000
// tasks while 100 jobs wait, and the events queues with std::priority_queue as yardstick.
#include <algorithm>
#include <array>
#include <numeric>
#include <queue>
#include <random>
#include <span>

#include "hotpath/core/events_queue.hpp"
#include "hotpath/core/registry.hpp"
#include "microbench/measurement.hpp"

namespace hotpath::microbench {
namespace {

constexpr std::uint32_t kTasks = 1000, kReady = 100;

/// The numbers below `n` in random order.
std::vector<std::uint32_t> shuffled(std::uint32_t n, std::uint64_t seed) {
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0U);
  std::shuffle(order.begin(), order.end(), std::mt19937_64(seed));
  return order;
}

/// `n` tasks, each in a separate callback group. One timer is due every microsecond.
TaskSet task_set(std::uint32_t n, TaskKind kind) {
  const std::vector<std::uint32_t> phase = shuffled(n, 1), urgency = shuffled(n, 2);
  TaskSet set;
  set.groups.assign(n, CallbackGroup::mutually_exclusive);
  for (std::uint32_t i = 0; i < n; ++i) {
    Task& t = set.tasks.emplace_back();
    t.kind = kind;
    t.group = i;
    t.priority = urgency[i];
    if (kind != TaskKind::timer) continue;
    t.period = n * 1us;
    t.phase = phase[i] * 1us;
    t.deadline = urgency[i] * 1us + 1us;
  }
  return set;
}

/// One scheduler in virtual time, with a microsecond per release, while kReady jobs wait: of timers
/// that become due one after another, or of random subscriptions without a sample.
class Cycle {
 public:
  Cycle(const ExecutorEntry& executor, TaskKind kind)
      : timers_(kind == TaskKind::timer),
        scheduler_(executor.make(task_set(kTasks, kind), {})),
        worker_(timers_ ? executor.traits.timer_worker() : Worker{0}),
        idle_(shuffled(kTasks, 3)) {
    scheduler_->begin(now_ + 1us);
    prepare(kReady);
    for (std::uint32_t i = 0; i < kReady; ++i) release();
  }

  /// Chooses the next subscriptions.
  void prepare(std::int64_t count) {
    for (std::int64_t i = 0; i < count && !timers_; ++i) {
      std::swap(idle_[random_() % idle_.size()], idle_.back());
      next_.push_back(idle_.back());
      idle_.pop_back();
    }
  }
  void release() {
    now_ += 1us;
    if (timers_) {
      const auto releaser = static_cast<Worker>(scheduler_->workers().size() - 1);
      benchmark::DoNotOptimize(scheduler_->release_timers(releaser, now_));
      return;
    }
    const SampleInfo sample{now_, now_ + (next_.back() % 1024) * 1us, {}};
    benchmark::DoNotOptimize(scheduler_->sample_arrived(next_.back(), sample, now_));
    next_.pop_back();
  }
  Job decide() { return *scheduler_->decide(worker_, now_).job; }
  void finish(const Job& job) {
    benchmark::DoNotOptimize(scheduler_->finished(worker_, job, now_));
    if (!timers_) idle_.push_back(job.task);
  }

 private:
  const bool timers_;
  const std::unique_ptr<Scheduler> scheduler_;
  const Worker worker_;
  Time now_{};
  std::vector<std::uint32_t> idle_, next_;
  std::mt19937 random_{4};
};

/// Time: mean of release, decision and finish of one job. Counter: the median of the decision over
/// blocks, which is robust against the interruption of a block. A block is large enough to hide the
/// cost of reading the clock, and small enough to hardly change the ready queue.
void cycle(benchmark::State& state, const ExecutorEntry& executor, TaskKind kind) {
  constexpr std::int64_t kBlock = 50;
  Cycle jobs(executor, kind);
  std::array<Job, kBlock> running;
  std::vector<double> decisions;
  while (state.KeepRunningBatch(kBlock)) {
    jobs.prepare(kBlock);
    const Time begin = now();
    for (std::int64_t i = 0; i < kBlock; ++i) jobs.release();
    const Time released = now();
    for (Job& job : running) job = jobs.decide();
    const Time decided = now();
    for (const Job& job : running) jobs.finish(job);
    state.SetIterationTime(std::chrono::duration<double>(now() - begin).count());
    decisions.push_back(ns(decided - released) / kBlock);
  }
  state.counters["decide_ns"] = quantiles(std::move(decisions)).p50;
}

/// The queues' experiment: the first of kReady jobs leaves and returns with a later deadline.
template <class Queue>
void hold(benchmark::State& state, Queue queue) {
  // Random distances from one deadline of a task to the next.
  std::array<Duration, 4096> distances;
  std::mt19937 random(5);
  std::uniform_int_distribution<std::int64_t> distance(0, 2000 * kReady);
  for (Duration& d : distances) d = Duration(distance(random));
  std::size_t at = 0;
  const auto next = [&] { return distances[at++ % distances.size()]; };
  for (TaskId id = 0; id < kReady; ++id) {
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
}

/// Jobs by absolute deadline.
struct StandardQueue {
  struct KeyedJob {
    PriorityKey key;
    Job job;
    bool operator<(const KeyedJob& other) const { return other.key < key; }
  };
  std::priority_queue<KeyedJob> queue;
  void push(const Job& job) { queue.push({{to_ns(job.deadline), job.task}, job}); }
  Job pop() {
    const Job job = queue.top().job;
    static_cast<void>(queue.pop());
    return job;
  }
};

}  // namespace

void register_all(bool quick) {
  const double min_time = quick ? 0.01 : 0.05;
  const auto add = [=](const std::string& name, auto measure) {
    return benchmark::RegisterBenchmark(name.c_str(), measure)->MinTime(min_time);
  };
  const std::array cycles = {std::pair{"rm-ro", TaskKind::timer}, std::pair{"fp-ro", TaskKind::timer},
                             std::pair{"edf-ro", TaskKind::timer}, std::pair{"cbg", TaskKind::subscription}};
  for (const auto& [name, kind] : cycles) {
    const std::string what = kind == TaskKind::timer ? "timer_cycle/" : "sample_cycle/";
    const ExecutorEntry& executor = *find_executor(name);
    add(what + name + "/ready:100/tasks/1000", [&executor, kind = kind](benchmark::State& s) {
      cycle(s, executor, kind);
    })->UseManualTime();
  }
  add("push_pop/std::priority_queue/ready/100", [](benchmark::State& s) { hold(s, StandardQueue{}); });
  add("push_pop/PriorityEventsQueue/ready/100", [](benchmark::State& s) {
    hold(s, PriorityEventsQueue(PriorityOrder(task_set(kReady, TaskKind::timer), Policy::edf,
                                              SubscriptionRule::inherit, Ties::lifo)));
  });
}

}  // namespace hotpath::microbench
