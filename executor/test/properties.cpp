// SPDX-License-Identifier: Apache-2.0
#include "properties.hpp"

#include <sstream>

#include "changing_tasks.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/core/trace_csv.hpp"
#include "schedule_checks.hpp"

namespace hotpath::test {

namespace {

constexpr Duration kRun = 400ms;
constexpr std::size_t kFewestJobs = 10;

bool coin(Random& random) { return uniform(random, 0, 1) == 0; }
template <class Number = int>
Number number(Random& random, int lowest, int highest) {
  return static_cast<Number>(uniform(random, lowest, highest));
}
/// A utilisation between `lowest` and `highest` tenths.
double tenths(Random& random, int lowest, int highest) { return 0.1 * number(random, lowest, highest); }

/// Random execution times in [BCET, WCET].
Trace run_random(const TaskSet& set, const ExecutorEntry& executor, std::uint64_t seed,
                 const Platform& platform, const SchedulerOptions& scheduling = {}) {
  const UniformTimes times(set, seed);
  PublishingWorkload workload(times);
  return simulate_trace(set, executor, scheduling, workload, {.platform = platform, .duration = kRun});
}

std::string policy_of(const ExecutorEntry& executor) { return to_string(*executor.traits.policy); }

CaseResult result(const Trace& trace, std::string problem) { return {std::move(problem), trace.jobs.size()}; }

TaskSet random_groups(Random& random, TaskSet set) {
  for (CallbackGroup& group : set.groups) {
    if (uniform(random, 0, 2) == 0) group = CallbackGroup::reentrant;
  }
  const auto last_group = static_cast<std::int64_t>(set.groups.size()) - 1;
  for (Task& task : set.tasks) {
    if (uniform(random, 0, 2) == 0) task.group = static_cast<std::uint32_t>(uniform(random, 0, last_group));
  }
  return set;
}

Platform random_platform(Random& random) {
  Platform platform;
  platform.cores = number<unsigned>(random, 1, 3);
  platform.raised_releaser = coin(random);
  platform.time_slice = uniform(random, 100, 4000) * 1us;
  platform.wall_clock_work = coin(random);
  if (coin(random)) {
    platform.release_cost = uniform(random, 0, 100) * 1us;
    platform.pass_cost = uniform(random, 0, 100) * 1us;
    platform.timer_dispatch_cost = uniform(random, 0, 100) * 1us;
    platform.subscription_dispatch_cost = uniform(random, 0, 100) * 1us;
    platform.delivery_delay = uniform(random, 0, 2000) * 1us;
    platform.wake_up_latency = uniform(random, 0, 200) * 1us;
  }
  return platform;
}

/// Holds on any platform: one job per worker at a time, no job before its release, loss equations,
/// callback groups.
CaseResult legal_and_nothing_lost(const ExecutorEntry& executor, std::uint64_t seed) {
  Random random(seed);
  const int timers = number(random, 1, 6), subscriptions = number(random, 0, 8);
  const TaskSet set =
      random_groups(random, random_graph(random, timers, subscriptions, tenths(random, 1, 14)));
  const Platform platform = random_platform(random);
  SchedulerOptions scheduling;
  scheduling.rule = coin(random) ? SubscriptionRule::inherit : SubscriptionRule::first;
  scheduling.ties = coin(random) ? Ties::lifo : Ties::fifo;
  scheduling.workers = number<unsigned>(random, 1, 4);
  const Trace trace = run_random(set, executor, seed, platform, scheduling);
  std::string problem = legal(set, trace);
  if (problem.empty()) problem = balanced(set, trace);
  if (problem.empty() && executor.traits.many_workers) problem = groups_exclusive(set, trace);
  return result(trace, std::move(problem));
}

std::string rows_of(const TaskSet& set, const Trace& trace) {
  std::ostringstream rows;
  write_jobs_csv(rows, set, trace);
  return rows.str();
}

SimulatedThread random_thread(Random& random, unsigned cores) {
  SimulatedThread thread;
  if (coin(random)) thread.priority = number(random, 1, 99);
  thread.nice = number(random, -5, 5);
  thread.processors = static_cast<std::uint64_t>(uniform(random, 1, (1 << cores) - 1));
  return thread;
}

/// One randomly drawn executor of several.
struct DrawnExecutor {
  const ExecutorEntry* entry;
  SchedulerOptions scheduling;
  std::vector<SimulatedThread> threads;
};

/// Whether each scheduler knows all tasks and serves its own, or knows only its own.
enum class Knows : std::uint8_t { all_tasks, its_part };

Trace run_deployment(const TaskSet& set, const std::vector<DrawnExecutor>& drawn,
                     const std::vector<std::uint32_t>& executor_of, const SimulationOptions& options,
                     std::uint64_t seed, Knows knows) {
  std::vector<std::unique_ptr<Scheduler>> schedulers;
  std::vector<SimulatedExecutor> simulated;
  for (std::uint32_t e = 0; e < drawn.size(); ++e) {
    const auto& [entry, scheduling, threads] = drawn[e];
    TaskSet own = set;
    std::vector<TaskId> ids;
    for (TaskId id = 0; id < set.size(); ++id) {
      own.tasks[id].local = executor_of[id] == e;
      if (own.tasks[id].local) ids.push_back(id);
    }
    const auto policy = entry->traits.policy;
    if (knows == Knows::its_part) {
      own = part_of(set, ids, policy ? most_urgent_timers(set, *policy) : std::vector<TaskId>{}).set;
    } else {
      ids.clear();
    }
    schedulers.push_back(entry->make(own, scheduling));
    simulated.push_back({schedulers.back().get(), threads, 0, ids});
  }
  return run(set, simulated, executor_of, UniformTimes(set, seed), options);
}

/// Distributes callback groups at random over executors; their threads have random priorities and
/// cores.
CaseResult deployment_legal_and_nothing_lost(std::uint64_t seed) {
  Random random(seed);
  const TaskSet set = random_groups(random, random_graph(random, 5, 6, tenths(random, 1, 20)));
  SimulationOptions options;
  options.platform = random_platform(random);
  options.duration = kRun;
  const auto parts = static_cast<std::uint32_t>(uniform(random, 1, 4));
  std::vector<std::uint32_t> executor_of_group, executor_of;
  for (std::size_t g = 0; g < set.groups.size(); ++g) {
    executor_of_group.push_back(static_cast<std::uint32_t>(uniform(random, 0, parts - 1)));
  }
  for (const Task& task : set.tasks) executor_of.push_back(executor_of_group[task.group]);
  std::vector<DrawnExecutor> drawn;
  bool exclusive = true;  // whether all executors respect callback groups
  for (std::uint32_t e = 0; e < parts; ++e) {
    DrawnExecutor& executor = drawn.emplace_back();
    executor.entry = &executors()[number<std::size_t>(random, 0, static_cast<int>(executors().size()) - 1)];
    exclusive &= executor.entry->traits.many_workers || worker_count(*executor.entry, {}) == 1;
    executor.scheduling.workers = number<unsigned>(random, 1, 3);
    for (std::uint32_t w = 0; w < worker_count(*executor.entry, executor.scheduling); ++w) {
      executor.threads.push_back(random_thread(random, options.platform.cores));
    }
  }
  const Trace trace = run_deployment(set, drawn, executor_of, options, seed, Knows::all_tasks);
  std::string problem = legal(set, trace);
  if (problem.empty()) problem = balanced(set, trace);
  if (problem.empty() && exclusive) problem = groups_exclusive(set, trace);
  const Trace of_parts = run_deployment(set, drawn, executor_of, options, seed, Knows::its_part);
  if (problem.empty() && rows_of(set, trace) != rows_of(set, of_parts)) {
    problem = "schedulers that know only their own tasks decide differently";
  }
  return result(trace, std::move(problem));
}

CaseResult tasks_come_and_go(const ExecutorEntry& executor, std::uint64_t seed) {
  ChangingTasks run(executor, seed);
  std::string problem = run.run(400);
  return {std::move(problem), run.jobs()};
}

CaseResult works_while_a_job_waits(const ExecutorEntry& executor, std::uint64_t seed) {
  Random random(seed);
  const int timers = number(random, 1, 6), subscriptions = number(random, 0, 8);
  const TaskSet set = random_graph(random, timers, subscriptions, tenths(random, 3, 11), 1);
  const Trace trace = run_random(set, executor, seed, {}, {.workers = 1});
  return result(trace, work_conserving(trace, 1));
}

/// Every worker has its own core.
CaseResult runs_for_the_execution_time(const ExecutorEntry& executor, std::uint64_t seed) {
  Random random(seed);
  const TaskSet set = random_graph(random, 4, 6, 0.8);
  const Trace trace = run_random(set, executor, seed, {.cores = 4}, {.workers = 4});
  const UniformTimes times(set, seed);
  for (const JobRecord& r : trace.jobs) {
    if (r.outcome == Outcome::ran && r.finish - r.start != times.of(r.job)) {
      return result(trace, "did not run for its execution time: " + describe(r));
    }
  }
  return result(trace, {});
}

CaseResult reentrant_groups_leave_no_worker_idle(const ExecutorEntry& multi, std::uint64_t seed) {
  Random random(seed);
  TaskSet set = random_graph(random, 5, 6, 2.0, 1);
  for (CallbackGroup& group : set.groups) group = CallbackGroup::reentrant;
  const Trace trace = run_random(set, multi, seed, {.cores = 3}, {.workers = 3});
  return result(trace, work_conserving(trace, 3));
}

/// With the remedy against starvation: a ready task runs before any other task of its group has run
/// three times.
CaseResult nobody_is_overtaken_for_ever(const ExecutorEntry& fair, std::uint64_t seed) {
  Random random(seed);
  const TaskSet set = random_groups(random, random_graph(random, 5, 4, tenths(random, 5, 30)));
  const Trace trace = run_random(set, fair, seed, {.cores = 3}, {.workers = 3});
  for (const JobRecord& waits : trace.jobs) {
    if (!waits.started() && waits.outcome != Outcome::queued) continue;
    const Time until = waits.started() ? waits.start : trace.end;
    // A window takes only one of several unread samples.
    Time from = waits.job.timestamp;
    for (const JobRecord& own : trace.jobs) {
      if (own.started() && own.job.task == waits.job.task && own.start < until)
        from = std::max(from, own.start);
    }
    std::map<TaskId, int> ahead;
    for (const JobRecord& other : trace.jobs) {
      if (!other.started() || set[other.job.task].group != set[waits.job.task].group) continue;
      if (other.job.task == waits.job.task || other.start <= from || other.start >= until) continue;
      if (++ahead[other.job.task] > 2) return result(trace, "overtaken for ever: " + describe(waits));
    }
  }
  return result(trace, {});
}

/// Per worker: no job starts while one of higher priority waits, and at most one job of lower
/// priority blocks.
CaseResult follows_priorities(const ExecutorEntry& executor, std::uint64_t seed) {
  Random random(seed);
  // An event takes the oldest unread sample, not necessarily the sample that raised it. It has that
  // sample's deadline only if no sample is overwritten and the deadlines of a reader's samples never
  // decrease.
  const bool deadlines = by_deadline(traits_of(*executor.traits.policy).levels);
  const int timers = number(random, 2, 6), subscriptions = number(random, 0, 6);
  TaskSet set = random_graph(random, timers, subscriptions, tenths(random, 3, 11), 3, deadlines ? 1 : 2);
  if (deadlines) {
    for (Task& task : set.tasks) task.depth = 1000;
  }
  std::vector<int> worker(set.size(), 0);
  for (TaskId id = 0; id < set.size(); ++id) {
    if (set[id].kind == TaskKind::timer) worker[id] = static_cast<int>(executor.traits.timer_worker());
  }
  const Trace trace = run_random(set, executor, seed, {.cores = number<unsigned>(random, 1, 2)});
  return result(trace, priority_driven(trace, PriorityByTheBook(set, policy_of(executor)), worker));
}

CaseResult skips_no_release(const ExecutorEntry& executor, std::uint64_t seed) {
  Random random(seed);
  const TaskSet set = random_graph(random, 5, 5, tenths(random, 3, 20));
  const Trace trace = run_random(set, executor, seed, {});
  for (TaskId id = 0; id < set.size(); ++id) {
    if (skipped(trace, id) > 0) return result(trace, "skips releases of task " + std::to_string(id));
  }
  return result(trace, {});
}

std::string difference(const std::vector<Ran>& a, const std::vector<Ran>& b) {
  if (a == b) return {};
  const auto [in_a, in_b] = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
  std::ostringstream out;
  out << "the schedules differ from job " << in_a - a.begin() << " on: ";
  in_a == a.end() ? out << "none" : out << *in_a;
  out << " against ";
  in_b == b.end() ? out << "none" : out << *in_b;
  return out.str();
}

/// Paper, Section V-A: timers only, every WCET shorter than every period.
CaseResult release_only_equals_release_and_execute(const std::string& policy, std::uint64_t seed) {
  Random random(seed);
  TaskSet set;
  for (Duration shortest{}, longest{}; longest >= shortest;) {
    set = random_timers(random, number(random, 2, 8), tenths(random, 2, 12));
    shortest = Duration::max();
    longest = Duration{};
    for (const Task& task : set.tasks) {
      shortest = std::min(shortest, task.period);
      longest = std::max(longest, task.wcet);
    }
  }
  const Trace ro = run_random(set, *find_executor(policy + "-ro"), seed, {});
  const Trace re = run_random(set, *find_executor(policy + "-re"), seed, {});
  return result(ro, difference(schedule(ro), schedule(re)));
}

}  // namespace

std::vector<Property> properties() {
  std::vector<Property> all;
  const auto add = [&](const std::string& name, std::uint64_t cases, const ExecutorEntry& executor,
                       CaseResult (*check)(const ExecutorEntry&, std::uint64_t)) {
    all.push_back({name + "/" + std::string(executor.name), cases, kFewestJobs,
                   [check, &executor](std::uint64_t seed) { return check(executor, seed); }});
  };
  for (const ExecutorEntry& executor : executors()) {
    add("legal_and_nothing_lost", 1000, executor, legal_and_nothing_lost);
    add("tasks_come_and_go", 1000, executor, tasks_come_and_go);
    add("works_while_a_job_waits", 600, executor, works_while_a_job_waits);
    add("runs_for_the_execution_time", 50, executor, runs_for_the_execution_time);
    if (executor.traits.many_workers && executor.traits.family == Family::wait_set) {
      add("reentrant_groups_leave_no_worker_idle", 600, executor, reentrant_groups_leave_no_worker_idle);
    }
    if (executor.name == "multi-fair") {
      add("nobody_is_overtaken_for_ever", 600, executor, nobody_is_overtaken_for_ever);
    }
    if (executor.traits.family != Family::priority_events) continue;
    add("follows_priorities", 600, executor, follows_priorities);
    if (executor.traits.timers != TimerHandling::release_only) continue;
    add("skips_no_release", 300, executor, skips_no_release);
    const std::string policy = policy_of(executor);
    if (find_executor(policy + "-re") != nullptr) {
      all.push_back(
          {"release_only_equals_release_and_execute/" + policy, 600, kFewestJobs,
           [policy](std::uint64_t seed) { return release_only_equals_release_and_execute(policy, seed); }});
    }
  }
  all.push_back({"deployment_legal_and_nothing_lost", 3000, kFewestJobs, deployment_legal_and_nothing_lost});
  return all;
}

}  // namespace hotpath::test
