// SPDX-License-Identifier: Apache-2.0
// What the scheduling core costs without any thread: release, decision and finish of one job against the
// number of tasks and of ready jobs, with bare containers as yardsticks in the same program.
#include <algorithm>
#include <array>
#include <numeric>
#include <queue>
#include <random>
#include <string>

#include "hotpath/core/priority_events_queue.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/core/simple_events_queue.hpp"
#include "microbench/program.hpp"
#include "results/statistics.hpp"

namespace {

using namespace hotpath;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// Jobs of one timed block: so many that reading the clock does not count, so few that the ready queue hardly
/// changes.
constexpr std::int64_t kBlock = 50;

std::int64_t block_of(std::int64_t tasks) { return std::min(kBlock, tasks / 2); }

std::vector<std::uint32_t> shuffled(std::int64_t n, std::uint64_t seed) {
  std::vector<std::uint32_t> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 0U);
  std::shuffle(order.begin(), order.end(), std::mt19937_64(seed));
  return order;
}

/// `n` tasks, each in a callback group of its own. Timers: one is due every microsecond.
TaskSet task_set(std::int64_t n, TaskKind kind) {
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

/// Timers become due one after another; `ready` of them wait all the time.
class TimerCycle {
 public:
  TimerCycle(const ExecutorEntry& executor, std::int64_t tasks, std::int64_t ready)
      : scheduler_(executor.make(task_set(tasks, TaskKind::timer), {})),
        worker_(executor.name.ends_with("-re") ? 1 : 0) {
    scheduler_->begin(Time{} + 1us);
    for (std::int64_t i = 0; i < ready; ++i) release();
  }
  void prepare(std::int64_t) {}
  void release() {
    now_ += 1us;
    const Worker releaser = static_cast<Worker>(scheduler_->workers().size() - 1);
    benchmark::DoNotOptimize(scheduler_->release_timers(releaser, now_));
  }
  Decision decide() { return scheduler_->decide(worker_, now_); }
  void finish(const Job& job) { benchmark::DoNotOptimize(scheduler_->finished(worker_, job, now_)); }

 private:
  std::unique_ptr<Scheduler> scheduler_;
  const Worker worker_;
  Time now_{};
};

/// Samples arrive for random subscriptions that have none; `ready` of them hold one all the time. Of the
/// priorities, EDF takes the deadline that comes with the sample, and the others what the graph gives (policy
/// fp).
class SampleCycle {
 public:
  SampleCycle(const ExecutorEntry& executor, std::int64_t tasks, std::int64_t ready)
      : scheduler_(executor.make(task_set(tasks, TaskKind::subscription), {})), idle_(shuffled(tasks, 3)) {
    scheduler_->begin(Time{});
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
  Decision decide() { return scheduler_->decide(0, now_); }
  void finish(const Job& job) {
    benchmark::DoNotOptimize(scheduler_->finished(0, job, now_));
    idle_.push_back(job.task);
  }

 private:
  std::unique_ptr<Scheduler> scheduler_;
  std::vector<std::uint32_t> idle_, next_;
  std::mt19937 random_{4};
  Time now_{};
};

enum class Ready { empty, hundred, full };

std::int64_t ready_jobs(Ready ready, std::int64_t tasks) {
  switch (ready) {
    case Ready::empty:
      return 0;
    case Ready::hundred:
      return 100;
    case Ready::full:
      return tasks - block_of(tasks);
  }
  return 0;
}

/// Time of one operation: the median over blocks, which an interruption of one block does not change.
class BlockTimes {
 public:
  explicit BlockTimes(std::int64_t block) : block_(block) { per_job_ns_.reserve(kKept); }
  void add(Clock::duration d) {
    if (per_job_ns_.size() < kKept) {
      per_job_ns_.push_back(static_cast<double>(Duration(d).count()) / static_cast<double>(block_));
    }
  }
  double median() { return quantiles(std::move(per_job_ns_)).p50; }

 private:
  static constexpr std::size_t kKept = 100'000;
  const std::int64_t block_;
  std::vector<double> per_job_ns_;
};

/// Time: release, decision and finish of one job, the mean. Counters: each of them.
template <class Cycle>
void cycle(benchmark::State& state, const ExecutorEntry& executor, Ready ready) {
  const std::int64_t tasks = state.range(0), block = block_of(tasks);
  Cycle jobs(executor, tasks, ready_jobs(ready, tasks));
  std::array<Job, kBlock> running;
  BlockTimes release(block), decide(block), finish(block);
  while (state.KeepRunningBatch(block)) {
    jobs.prepare(block);
    const Clock::time_point t0 = Clock::now();
    for (std::int64_t i = 0; i < block; ++i) jobs.release();
    const Clock::time_point t1 = Clock::now();
    for (std::int64_t i = 0; i < block; ++i) running[static_cast<std::size_t>(i)] = *jobs.decide().job;
    const Clock::time_point t2 = Clock::now();
    for (std::int64_t i = 0; i < block; ++i) jobs.finish(running[static_cast<std::size_t>(i)]);
    const Clock::time_point t3 = Clock::now();
    release.add(t1 - t0);
    decide.add(t2 - t1);
    finish.add(t3 - t2);
    state.SetIterationTime(std::chrono::duration<double>(t3 - t0).count());
  }
  state.counters["release_ns"] = release.median();
  state.counters["decide_ns"] = decide.median();
  state.counters["finish_ns"] = finish.median();
  state.SetComplexityN(tasks);
}

/// All timers due at once: released and decided to the last.
void drain(benchmark::State& state, const ExecutorEntry& executor) {
  TaskSet set = task_set(state.range(0), TaskKind::timer);
  for (Task& t : set.tasks) t.phase = 0us;
  const Duration period = set.tasks.front().period;
  const auto scheduler = executor.make(set, {});
  const Worker releaser = static_cast<Worker>(scheduler->workers().size() - 1);
  const Worker worker = executor.name.ends_with("-re") ? 1 : 0;
  Time now{};
  scheduler->begin(now);
  for (auto _ : state) {
    while (scheduler->release_timers(releaser, now).released > 0) {
    }
    while (const auto job = scheduler->decide(worker, now).job) {
      benchmark::DoNotOptimize(scheduler->finished(worker, *job, now));
    }
    now += period;
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
  state.SetComplexityN(state.range(0));
}

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
    queue.pop();
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
    queue.pop();
    return job;
  }
};

struct SortedVector {
  std::vector<KeyedJob> jobs;  // the first to run stands last
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

void register_all(bool quick) {
  const std::int64_t most = quick ? 10'000 : 100'000;
  const double min_time = quick ? 0.01 : 0.05;
  const auto grow = [&](benchmark::internal::Benchmark* b, std::int64_t least, std::int64_t largest) {
    b->RangeMultiplier(10)->Range(least, largest)->MinTime(min_time)->Complexity();
    return b;
  };
  // dm and fp differ from rm in the table of priorities alone.
  const std::array timers = {"default", "static", "multi", "events-ro", "events-re",
                             "rm-ro",   "rm-re",  "fp-ro", "edf-ro",    "edf-re"};
  // Release-only and release-and-execute treat samples alike.
  const std::array samples = {"default", "static", "multi", "events-ro", "fp-ro", "edf-ro"};
  const std::array levels = {std::pair{"empty", Ready::empty}, std::pair{"100", Ready::hundred},
                             std::pair{"full", Ready::full}};
  for (const auto& [level_name, level_value] : levels) {
    const Ready level = level_value;
    const std::int64_t least = level == Ready::hundred ? 1000 : 10;
    for (const char* name : timers) {
      const ExecutorEntry& e = *find_executor(name);
      grow(benchmark::RegisterBenchmark(
               ("timer_cycle/" + std::string(name) + "/ready:" + level_name + "/tasks").c_str(),
               [&e, level](benchmark::State& s) { cycle<TimerCycle>(s, e, level); }),
           least, most)
          ->UseManualTime();
    }
    for (const char* name : samples) {
      const ExecutorEntry& e = *find_executor(name);
      grow(benchmark::RegisterBenchmark(
               ("sample_cycle/" + std::string(name) + "/ready:" + level_name + "/tasks").c_str(),
               [&e, level](benchmark::State& s) { cycle<SampleCycle>(s, e, level); }),
           least, most)
          ->UseManualTime();
    }
  }
  for (const char* name : timers) {
    const ExecutorEntry& e = *find_executor(name);
    // The wait sets erase from the front of their snapshot: quadratic, so their largest set would take a
    // minute.
    const bool wait_set = e.make(TaskSet{}, {})->workers().back() == WorkerRole::executor;
    grow(benchmark::RegisterBenchmark(("drain/" + std::string(name) + "/tasks").c_str(),
                                      [&e](benchmark::State& s) { drain(s, e); }),
         100, wait_set ? std::min<std::int64_t>(most, 10'000) : most)
        ->Unit(benchmark::kMicrosecond);
  }
  const auto yardstick = [&](const char* name, auto run, std::int64_t largest) {
    grow(benchmark::RegisterBenchmark(name, run), 1, largest);
  };
  yardstick(
      "push_pop/std::priority_queue_of_keys/ready",
      [](benchmark::State& s) { hold(s, StandardQueueOfKeys{}); }, most);
  yardstick(
      "push_pop/std::priority_queue/ready", [](benchmark::State& s) { hold(s, StandardQueueOfJobs{}); },
      most);
  yardstick(
      "push_pop/sorted_vector/ready", [](benchmark::State& s) { hold(s, SortedVector{}); }, most);
  yardstick(
      "push_pop/SimpleEventsQueue/ready", [](benchmark::State& s) { hold(s, SimpleEventsQueue{}); }, most);
  yardstick(
      "push_pop/PriorityEventsQueue/ready", [](benchmark::State& s) { hold(s, edf_queue(s.range(0))); },
      most);
}

}  // namespace

int main(int argc, char** argv) { return gbench::run_program(argc, argv, register_all); }
