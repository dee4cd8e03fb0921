// SPDX-License-Identifier: Apache-2.0
// Several executors on several cores: threads with priorities and processors, compared with a small
// model that advances by milliseconds.
#include <gtest/gtest.h>

#include <numeric>

#include "hotpath/core/simulator.hpp"
#include "task_sets.hpp"

namespace hotpath::test::several_executors_test {

/// A single-threaded executor with its own thread for each timer of `set`.
Trace one_executor_each(const TaskSet& set, const std::vector<SimulatedThread>& threads, unsigned cores,
                        Duration duration) {
  std::vector<std::unique_ptr<Scheduler>> schedulers;
  std::vector<SimulatedExecutor> executors;
  std::vector<std::uint32_t> executor_of(set.size());
  std::iota(executor_of.begin(), executor_of.end(), 0);
  for (TaskId id = 0; id < set.size(); ++id) {
    TaskSet own = set;
    for (TaskId other = 0; other < set.size(); ++other) own.tasks[other].local = other == id;
    schedulers.push_back(find_executor("default")->make(own, {}));
    executors.push_back({schedulers.back().get(), {threads[id]}});
  }
  return run(set, executors, executor_of, WorstCaseTimes(set),
             {.platform = {.cores = cores}, .duration = duration});
}

/// Whether the threads can run at the same time, each on a core allowed to it.
bool fit(const std::vector<TaskId>& tasks, const std::vector<SimulatedThread>& threads, unsigned cores) {
  if (tasks.size() > cores) return false;
  std::vector<unsigned> order(cores);
  std::iota(order.begin(), order.end(), 0U);
  do {
    bool all = true;
    for (std::size_t i = 0; i < tasks.size(); ++i) all &= (threads[tasks[i]].processors >> order[i]) & 1U;
    if (all) return true;
  } while (std::next_permutation(order.begin(), order.end()));
  return false;
}

/// Start and finish of all jobs under preemptive fixed priorities, all times whole milliseconds.
std::vector<std::vector<Ran>> by_the_millisecond(const TaskSet& set,
                                                 const std::vector<SimulatedThread>& threads, unsigned cores,
                                                 int duration_ms) {
  std::vector<TaskId> by_priority(set.size());
  std::iota(by_priority.begin(), by_priority.end(), 0U);
  std::sort(by_priority.begin(), by_priority.end(),
            [&](TaskId a, TaskId b) { return threads[a].priority > threads[b].priority; });
  std::vector<Duration> next_call, left(set.size(), 0ms);
  for (const Task& task : set.tasks) next_call.push_back(task.phase);
  std::vector<std::vector<Ran>> jobs(set.size());
  for (Duration now = 0ms; now < duration_ms * 1ms; now += 1ms) {
    std::vector<TaskId> running;
    for (const TaskId id : by_priority) {
      if (left[id] == 0ms && next_call[id] > now) continue;
      running.push_back(id);
      if (!fit(running, threads, cores)) running.pop_back();
    }
    for (const TaskId id : running) {
      if (left[id] == 0ms) {
        const auto number = static_cast<std::uint64_t>((next_call[id] - set[id].phase) / set[id].period);
        while (next_call[id] <= now) next_call[id] += set[id].period;
        left[id] = set[id].wcet;
        jobs[id].push_back({id, number, now, 0ms});
      }
      left[id] -= 1ms;
      if (left[id] == 0ms) jobs[id].back().finish = now + 1ms;
    }
  }
  return jobs;
}

TEST(PreemptiveFixedPriorities, EqualASecondModelForRandomThreadsOnRandomProcessors) {
  constexpr int kDuration = 120;
  for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
    Random random(seed);
    const auto cores = static_cast<unsigned>(uniform(random, 1, 3));
    TaskSet set;
    std::vector<SimulatedThread> threads;
    std::vector<int> priorities(static_cast<std::size_t>(uniform(random, 1, 6)));
    std::iota(priorities.begin(), priorities.end(), 1);
    std::shuffle(priorities.begin(), priorities.end(), random);
    for (const int priority : priorities) {
      add_timer(set, uniform(random, 4, 20) * 1ms, uniform(random, 1, 6) * 1ms, uniform(random, 0, 9) * 1ms);
      const auto processors = static_cast<std::uint64_t>(uniform(random, 1, (1 << cores) - 1));
      threads.push_back({priority, 0, processors});
    }
    const Trace trace = one_executor_each(set, threads, cores, kDuration * 1ms);
    std::vector<std::vector<Ran>> simulated(set.size());
    for (const Ran& job : schedule(trace)) simulated[job.task].push_back(job);
    auto expected = by_the_millisecond(set, threads, cores, kDuration);
    for (TaskId id = 0; id < set.size(); ++id) {
      // Only one of the two models completes a job that ends with the run.
      std::erase_if(expected[id],
                    [&](const Ran& r) { return r.finish == 0ms || r.finish == kDuration * 1ms; });
      ASSERT_EQ(simulated[id], expected[id]) << "seed " << seed << ", task " << id;
    }
  }
}

TEST(PriorityInheritance, LastsAsLongAsTheLock) {
  TaskSet set;
  const TaskId first = add_timer(set, 100ms, 1ms), second = add_timer(set, 100ms, 1ms, 2ms);
  const TaskId subscription = add_subscription(set, {first}, 3ms);
  const auto scheduler = find_executor("rm-re")->make(set, {});
  const SimulatedExecutor executor{scheduler.get(), {{2}, {1}}};
  const Trace trace = run(set, {&executor, 1}, std::vector<std::uint32_t>(set.size(), 0), WorstCaseTimes(set),
                          {.platform = {.release_cost = 1ms, .delivery_delay = 500us}, .duration = 20ms});
  // At 2.5 ms the executor thread waits for the timer thread, which releases the second timer until 3 ms.
  EXPECT_EQ(schedule(trace),
            (std::vector<Ran>{{first, 0, 1ms, 2ms}, {subscription, 0, 3ms, 6ms}, {second, 0, 6ms, 7ms}}));
}

TEST(OrdinaryPolicy, NiceScalesTheTimeSlice) {
  TaskSet set;
  add_timer(set, 1s, 90ms);
  add_timer(set, 1s, 90ms);
  const Trace trace = one_executor_each(set, {{0, -5, 1}, {0, 0, 1}}, 1, 500ms);
  // 3.05 times the share of the core until the first job is done, then all of it.
  EXPECT_NEAR(to_ms(schedule(trace)[0].finish), 90 * (1 + 1 / 3.05), 10);
  EXPECT_EQ(schedule(trace)[1].finish, 180ms);
}

}  // namespace hotpath::test::several_executors_test
