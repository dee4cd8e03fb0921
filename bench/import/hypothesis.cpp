// SPDX-License-Identifier: Apache-2.0
#include "import/recognition.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "program/text.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::imports {

namespace {

/// Marks the decisions at which a task was ready that ran later.
void find_contests(const TaskSet& set, RecordedSteps& recorded) {
  std::vector<std::size_t> started(set.size(), 0);
  std::vector<int> running(set.groups.size(), 0);
  std::vector<Time> free(recorded.ready_on.size(), Time::min());
  for (RecordedStep& step : recorded.steps) {
    if (step.kind == RecordedStep::Kind::arrival) continue;
    const bool exclusive = set.groups[set[step.task].group] == CallbackGroup::mutually_exclusive;
    if (step.kind == RecordedStep::Kind::finish) {
      free[step.thread] = step.at;
      if (exclusive) --running[set[step.task].group];
      continue;
    }
    step.free = free[step.thread];
    for (TaskId id = 0; id < set.size() && !step.contested; ++id) {
      const std::vector<Time>& ready = recorded.ready[id];
      step.contested = recorded.own[id] && id != step.task && running[set[id].group] == 0 &&
                       started[id] < ready.size() && ready[started[id]] <= step.at;
    }
    ++started[step.task];
    if (exclusive) ++running[set[step.task].group];
  }
}

/// The version of tracetools of each release, 100 * major + minor.
constexpr std::array<std::pair<int, RosDistro>, 4> kReleases = {
    {{401, RosDistro::humble}, {603, RosDistro::iron}, {802, RosDistro::jazzy}, {806, RosDistro::kilted}}};

/// Whether these releases have a later executor of this design.
bool is_superseded(const ExecutorEntry& entry, const RosDistros& releases) {
  return std::ranges::any_of(executors(), [&](const ExecutorEntry& other) {
    const auto &of = entry.traits.on_rclcpp, &on = other.traits.on_rclcpp;
    return of && on && on->first > of->first && on->first <= releases.first && on->last >= releases.last &&
           are_of_one_design(entry, other);
  });
}

/// Whether an executor with these traits can have run the threads, each of which ran a job.
bool fits_threads(const ExecutorTraits& traits, const RecordedSteps& recorded) {
  const std::size_t threads = recorded.has_timers.size();
  if (traits.timers == TimerHandling::release_and_execute) {
    const auto timer_threads = std::ranges::count(recorded.has_timers, true);
    const auto others = std::ranges::count(recorded.has_others, true);
    return timer_threads <= 1 && others <= 1 && static_cast<std::size_t>(timer_threads + others) == threads;
  }
  if (threads == 1) return !traits.many_workers || traits.family != Family::wait_set;
  return traits.many_workers && threads <= most_threads(traits);
}

/// Most comparisons of levels, and decisions of each: a bound on the time.
constexpr std::size_t kComparisons = 100, kDecisions = 2000;
/// Pairs of timers that each round tries to reorder.
constexpr std::size_t kPairs = 4;

using Levels = std::vector<std::int64_t>;
using Pair = std::pair<TaskId, TaskId>;

/// Levels of timers as 2, 4, 6, ..., so that each has a free level before and after it.
Levels ranks(const TaskSet& set, const Levels& levels) {
  std::set<std::int64_t> distinct;
  for (const TaskId id : set.timers()) distinct.insert(levels[id]);
  Levels ranks(levels.size(), 0);
  for (const TaskId id : set.timers())
    ranks[id] = 2 * (1 + std::distance(distinct.begin(), distinct.find(levels[id])));
  return ranks;
}

/// The pairs of timers whose jobs or readers contradict the levels most: what ran, and what was ahead of it.
std::vector<Pair> most_wrong(TaskSet set, const Levels& levels, const Agreement& agreement) {
  for (Task& task : set.tasks) task.priority.reset();
  for (const TaskId id : set.timers()) set.tasks[id].priority = levels[id];
  const std::vector<TaskId> origin = most_urgent_timers(set, Policy::fp);
  std::map<Pair, std::uint32_t> wrong;
  for (const auto& [pair, count] : agreement.before) {
    const TaskId ran = origin[pair.first], ahead = origin[pair.second];
    if (ran != ahead && ran != kNoTask && ahead != kNoTask) wrong[{ran, ahead}] += count;
  }
  std::vector<Pair> most;
  most.reserve(wrong.size());
  for (const auto& [pair, count] : wrong) most.push_back(pair);
  std::ranges::stable_sort(most, std::ranges::greater{}, [&](const Pair& pair) { return wrong.at(pair); });
  most.resize(std::min(most.size(), kPairs));
  return most;
}

RecordedSteps no_steps_yet(const RecordedGraph& graph, const RecordedWindow& window,
                           const RecordedExecutor& executor) {
  RecordedSteps steps;
  steps.epoch = graph.epoch;
  steps.own.resize(graph.tasks.set.size());
  steps.ready.resize(graph.tasks.set.size());
  steps.decided.resize(graph.tasks.set.size());
  for (auto* of_thread : {&steps.has_timers, &steps.has_others}) of_thread->resize(executor.threads.size());
  steps.ready_on.resize(executor.threads.size());
  steps.deadline.assign(window.jobs.size(), kNever);
  return steps;
}

using StepsOfEvents = std::vector<std::pair<RecordedStep, std::uint64_t>>;  // with their events

/// 0: none.
std::uint64_t event_of(const tracing::Job& publisher, Time published) {
  std::uint64_t event = 0;
  for (const tracing::Publication& p : publisher.published)
    if (p.at == published) event = p.event;
  return event;
}

/// The decision for a job or its start, and its end. `step` has its task, thread, number and readiness.
void add_start(const tracing::Job& job, RecordedStep step, RecordedSteps& result, StepsOfEvents& all) {
  result.ready[step.task].push_back(step.ready);
  result.ready_on[step.thread].push_back(step.ready);
  step.shows_decision = job.decided > Time{} && job.decided >= step.ready;
  step.at = step.shows_decision ? job.decided : job.start;
  result.decided[step.task].emplace_back(step.at, step.thread);
  all.emplace_back(step, step.shows_decision ? job.question : job.started);
  step.kind = RecordedStep::Kind::finish;
  step.at = job.finish;
  if (job.ended) all.emplace_back(step, job.finished);
}

}  // namespace

RecordedSteps recorded_steps(const RecordedGraph& graph, const RecordedWindow& window,
                             std::span<const tracing::LostSample> lost, const RecordedExecutor& executor,
                             std::size_t most) {
  const TaskSet& set = graph.tasks.set;
  RecordedSteps result = no_steps_yet(graph, window, executor);
  std::map<std::pair<TaskId, std::uint64_t>, std::uint32_t> job_at;  // by task and number
  const auto recorded_job = [&](const tracing::JobRef& ref) {
    const auto job = job_at.find({graph.task(ref), ref.number});
    return job == job_at.end() ? kNone : job->second;
  };
  StepsOfEvents all;
  const auto add_arrival = [&](TaskId task, const tracing::Sample& sample) {
    const std::uint32_t parent = recorded_job(sample.parent);
    const std::uint64_t event = parent == kNone ? 0 : event_of(window.jobs[parent], sample.published);
    using enum RecordedStep::Kind;
    all.push_back({{.kind = arrival, .at = sample.published, .task = task, .job = parent}, event});
  };
  Time last{};
  for (std::uint32_t j = 0; j < window.jobs.size() && result.starts < most; ++j) {
    const tracing::Job& job = window.jobs[j];
    const TaskId task = graph.task(job.ref);
    if (task == kNoTask) continue;
    const Time ready = window.records[j].job.timestamp;
    job_at[{task, job.ref.number}] = j;
    const bool timer = set[task].kind == TaskKind::timer;
    const std::uint32_t parent = recorded_job(job.sample.parent);
    if (timer) result.deadline[j] = ready + set[task].period;
    if (!timer && parent != kNone) result.deadline[j] = result.deadline[parent];
    const auto thread = std::ranges::find(executor.threads, job.thread);
    if (thread == executor.threads.end()) continue;
    const auto t = static_cast<std::uint32_t>(thread - executor.threads.begin());
    result.own[task] = true;
    (timer ? result.has_timers : result.has_others)[t] = true;
    ++result.starts;
    last = job.start;
    if (!timer) add_arrival(task, job.sample);
    add_start(job, {.task = task, .thread = t, .job = j, .ready = ready}, result, all);
  }
  for (const tracing::LostSample& sample : lost) {
    const TaskId task = graph.task({sample.subscription, 0});
    if (task != kNoTask && result.own[task] && sample.sample.published < last)
      add_arrival(task, sample.sample);
  }
  std::ranges::sort(all, {}, [](const auto& s) { return std::tuple(s.first.at, s.second, s.first.task); });
  for (const auto& [step, event] : all) result.steps.push_back(step);
  find_contests(set, result);
  return result;
}

RosDistros releases_of(const std::string& tracetools_version) {
  const auto point = std::min(tracetools_version.find('.'), tracetools_version.size());
  const int version = 100 * std::atoi(tracetools_version.c_str()) +
                      (point < tracetools_version.size() ? std::atoi(&tracetools_version[point + 1]) : 0);
  if (version < kReleases.front().first) return {};
  const auto to = std::ranges::lower_bound(kReleases, version, {}, [](const auto& r) { return r.first; });
  const RosDistro last = to == kReleases.end() ? RosDistro::lyrical : to->second;
  return {to != kReleases.end() && to->first == version ? last : std::prev(to)->second, last};
}

bool are_of_one_design(const ExecutorEntry& a, const ExecutorEntry& b) {
  const auto design = [](const ExecutorEntry& e) {
    return std::tuple(e.class_name, e.traits.family, e.traits.policy, e.traits.timers);
  };
  return design(a) == design(b);
}

bool emits_waits(const ExecutorTraits& traits) {
  return traits.family == Family::wait_set && traits.runs_first == TaskKind::timer;
}

std::vector<Hypothesis> possible_hypotheses(const RecordedSteps& recorded, bool waits,
                                            const RosDistros& releases) {
  std::vector<Hypothesis> possible;
  for (const ExecutorEntry& entry : executors()) {
    const ExecutorTraits& traits = entry.traits;
    if (emits_waits(traits) != waits || !fits_threads(traits, recorded)) continue;
    if (traits.on_rclcpp && !traits.on_rclcpp->overlap(releases)) continue;
    Hypothesis plain{std::string(entry.name), &entry, {}, {}, {}};
    plain.options.release = releases.last;
    plain.superseded = is_superseded(entry, releases);
    plain.order.resize(recorded.own.size());
    std::iota(plain.order.begin(), plain.order.end(), 0U);
    if (traits.many_workers) {
      plain.options.workers = static_cast<unsigned>(recorded.has_timers.size());
      plain.label = program::concat(plain.label, ":", plain.options.workers);
    }
    possible.push_back(plain);
    if (traits.family != Family::priority_events) continue;
    for (const auto& [rule, ties] :
         {std::pair(SubscriptionRule::first, Ties::lifo), std::pair(SubscriptionRule::inherit, Ties::fifo),
          std::pair(SubscriptionRule::first, Ties::fifo)}) {
      Hypothesis& variant = possible.emplace_back(plain);
      variant.options.rule = rule;
      variant.options.ties = ties;
      variant.label = setup::name_with_rules(entry, variant.options);
    }
  }
  return possible;
}

void fit_levels(const TaskSet& set, const RecordedSteps& steps, Hypothesis& hypothesis, std::size_t starts) {
  std::size_t comparisons = 0;
  Levels best;
  Agreement of_best;
  const auto keep_better = [&](const Levels& levels) {
    if (comparisons == kComparisons) return false;
    hypothesis.levels = ranks(set, levels);
    Agreement agreement = follow(set, steps, hypothesis, 0, std::min(starts, kDecisions));
    if (comparisons++ > 0 && agreement.contradictions >= of_best.contradictions) return false;
    of_best = std::move(agreement);
    best = hypothesis.levels;
    return true;
  };
  Levels by_period;
  for (const Task& task : set.tasks) by_period.push_back(task.period.count());
  keep_better(by_period);
  keep_better(Levels(set.size(), 1));
  const auto improve = [&] {
    const Levels& from = best;  // unchanged until a better one is found, which ends this
    for (const auto& [ran, ahead] : most_wrong(set, from, of_best)) {
      for (const auto& [timer, level] : {std::pair(ran, from[ahead] - 1), std::pair(ran, from[ahead]),
                                         std::pair(ahead, from[ran] + 1), std::pair(ahead, from[ran])}) {
        Levels to = from;
        to[timer] = level;
        if (keep_better(to)) return true;
      }
    }
    return false;
  };
  while (improve()) {
  }
  hypothesis.levels = best;
}

}  // namespace hotpath::imports
