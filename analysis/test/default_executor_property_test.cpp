// SPDX-License-Identifier: Apache-2.0
// Compares the default executor's bounds with the default executor itself: hotpath's wait set
// scheduler in virtual time.
#include <gtest/gtest.h>

#include "hotpath/analysis/teper_2024.hpp"
#include "hotpath/core/wait_set_scheduler.hpp"
#include "reference_simulation.hpp"

namespace hotpath {
namespace {

/// All jobs of each task until `end`, in order of start; execution times drawn from [bcet, wcet].
std::vector<std::vector<SimulatedJob>> run_default_executor(const TaskSet& set, std::int64_t end,
                                                            RandomStream& random) {
  WaitSetScheduler scheduler(set, 1);
  scheduler.begin(from_ns(0));
  std::vector<std::vector<SimulatedJob>> ran(set.size());
  std::vector<std::uint64_t> sequence(set.size(), 0);
  for (Time now = from_ns(0); to_ns(now) < end;) {
    const Turn turn = take_turn(scheduler, 0, now);
    if (!turn.decision.job) {
      now = turn.decision.wake_at;
      continue;
    }
    const Job job = *turn.decision.job;
    const Task& task = set[job.task];
    const std::int64_t spread = (task.wcet - task.bcet).count();
    const bool longest = random.below(2) == 0;
    const std::int64_t saved = longest ? 0 : static_cast<std::int64_t>(random.below(spread + 1));
    const Time finish = now + task.wcet - Duration(saved);
    ran[job.task].push_back({.start = to_ns(now), .finish = to_ns(finish)});
    now = finish;
    for (const TaskId next : task.feeds) {
      scheduler.sample_arrived(next, {.published = now, .deadline = job.deadline, .parent = job.ref()}, now);
    }
    scheduler.finished(0, job, now);
  }
  return ran;
}

/// Random timers, some of which start sequences of subscriptions, in random order of creation.
TaskSet random_set(RandomStream& random, bool subscriptions) {
  RandomSet parameters;
  parameters.max_tasks = 5;
  parameters.phases = true;
  parameters.shorter_runs = true;
  parameters.max_wcet_share = random.below(2) == 0 ? 0.3 : 0.9;
  PeriodicTasks tasks = random_tasks(random, parameters);
  random.shuffle(std::span(tasks));
  TaskSet set;
  for (const PeriodicTask& p : tasks) {
    set.tasks.push_back(as_timer(p, "t" + std::to_string(set.size())));
    for (std::size_t n = subscriptions ? random.below(4) : 0; n > 0; --n) {
      Task s;
      s.name = "s" + std::to_string(set.size());
      s.kind = TaskKind::subscription;
      s.wcet = Duration(1 + random.below(5));
      s.bcet = Duration(random.below(2));
      set.tasks.back().feeds = {set.size()};
      set.tasks.push_back(s);
    }
  }
  return set;
}

std::string as_text(const TaskSet& set) {
  std::string text = "\n";
  for (const Task& t : set.tasks) {
    text += t.name + ": period " + std::to_string(t.period.count()) + ", phase " +
            std::to_string(t.phase.count()) + ", execution time " + std::to_string(t.bcet.count()) + " to " +
            std::to_string(t.wcet.count());
    for (const TaskId next : t.feeds) text += ", feeds " + set[next].name;
    text += '\n';
  }
  return text;
}

/// A random walk: after a task that feeds another one comes that subscription, otherwise any timer.
std::vector<TaskId> random_chain(const TaskSet& set, RandomStream& random) {
  const auto any_timer = [&] {
    TaskId id = static_cast<TaskId>(random.below(set.size()));
    while (set[id].kind != TaskKind::timer) id = (id + 1) % set.size();
    return id;
  };
  std::vector<TaskId> chain = {any_timer()};
  for (std::size_t n = random.below(5); n > 0; --n) {
    const Task& last = set[chain.back()];
    chain.push_back(last.feeds.empty() ? any_timer() : last.feeds[0]);
  }
  return chain;
}

constexpr int kSets = 2000;
constexpr std::int64_t kEnd = 1500;

TEST(Teper2024, BoundsReactionTimesOfTheWaitSetScheduler) {
  RandomStream random(42, {0});
  for (int s = 0; s < kSets; ++s) {
    const TaskSet set = random_set(random, s % 2 == 0);
    const auto ran = run_default_executor(set, kEnd, random);
    for (int c = 0; c < 3; ++c) {
      const std::vector<TaskId> chain = random_chain(set, random);
      std::string names = "chain";
      for (const TaskId id : chain) names += " " + set[id].name;
      ASSERT_GE(teper_2024(set, chain), largest_reaction(ran, chain)) << names << as_text(set);
    }
  }
}

}  // namespace
}  // namespace hotpath
