// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_executors.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "program/text.hpp"

namespace hotpath {

namespace {

/// Threads joined into executors.
class Groups {
 public:
  explicit Groups(std::size_t threads) : parent_(threads) { std::iota(parent_.begin(), parent_.end(), 0U); }
  std::uint32_t find(std::uint32_t t) {
    while (parent_[t] != t) t = parent_[t] = parent_[parent_[t]];
    return t;
  }
  void join(std::uint32_t a, std::uint32_t b) { parent_[find(b)] = find(a); }

 private:
  std::vector<std::uint32_t> parent_;
};

bool counts(const RecordedSystem& system, std::uint32_t c) {
  const RecordedCallback& callback = system.callbacks[c];
  const bool is_task = callback.kind == RecordedKind::timer || callback.kind == RecordedKind::subscription;
  return is_task && callback.node != kNone && !callback.threads.empty();
}

/// What the callbacks of a thread are.
struct ThreadUse {
  bool timers = false, others = false;
  std::set<std::uint32_t> nodes;
};

std::vector<ThreadUse> uses_of(const RecordedSystem& system) {
  std::vector<ThreadUse> uses(system.threads.size());
  for (std::uint32_t c = 0; c < system.callbacks.size(); ++c) {
    if (!counts(system, c)) continue;
    for (const auto& [thread, jobs] : system.callbacks[c].threads) {
      (system.callbacks[c].kind == RecordedKind::timer ? uses[thread].timers : uses[thread].others) = true;
      uses[thread].nodes.insert(system.callbacks[c].node);
    }
  }
  return uses;
}

/// rcl 9 belongs to rclcpp 28 (Jazzy), which has other multi-threaded executors.
bool is_jazzy_or_later(const RecordedSystem& system) { return std::atoi(system.rcl_version.c_str()) >= 9; }

void find_candidates(const RecordedSystem& system, const std::vector<ThreadUse>& uses,
                     RecordedExecutor& executor) {
  const std::size_t threads = executor.threads.size();
  const bool waits =
      std::ranges::any_of(executor.threads, [&](std::uint32_t t) { return system.threads[t].waits > 0; });
  const bool timers_apart =
      threads == 2 &&
      std::ranges::any_of(executor.threads,
                          [&](std::uint32_t t) { return uses[t].timers && !uses[t].others; }) &&
      std::ranges::any_of(executor.threads, [&](std::uint32_t t) { return !uses[t].timers; });
  if (waits && threads == 1) {
    executor.candidates = {"default"};
    executor.why = "it has the events of rclcpp's waits and one thread runs its callbacks";
  } else if (waits) {
    executor.candidates = {concat(is_jazzy_or_later(system) ? "multi-jazzy:" : "multi:", threads)};
    executor.why = concat("it has the events of rclcpp's waits and ", threads,
                          " threads run its callbacks (rcl ", system.rcl_version, ")");
  } else if (timers_apart) {
    executor.candidates = {"events-re"};
    executor.why = "it has no events of waits, and timers run on a thread of their own";
  } else if (threads == 1) {
    executor.candidates = {"events-ro", "static", "cbg:1"};
    executor.why = "it has no events of waits and one thread";
  } else {
    const std::string multi = concat("multi:", threads), cbg = concat("cbg:", threads);
    executor.candidates = is_jazzy_or_later(system) ? std::vector{cbg} : std::vector{multi, cbg};
    executor.why = concat("it has no events of waits and ", threads, " threads");
  }
}

MeasuredCost cost_of(std::vector<Duration> samples, Duration without) {
  MeasuredCost cost;
  cost.n = samples.size();
  if (samples.empty()) return cost;
  std::ranges::sort(samples);
  const auto at = [&](std::size_t percent) {
    return std::max(Duration::zero(), samples[(samples.size() - 1) * percent / 100] - without);
  };
  cost.median = at(50);
  cost.p90 = at(90);
  return cost;
}

}  // namespace

RecordedExecutors recorded_executors(const RecordedSystem& system, const std::string& given) {
  Groups groups(system.threads.size());
  const std::vector<ThreadUse> uses = uses_of(system);
  for (std::uint32_t c = 0; c < system.callbacks.size(); ++c) {
    if (!counts(system, c)) continue;
    const auto& threads = system.callbacks[c].threads;
    for (const auto& [thread, jobs] : threads) groups.join(threads.begin()->first, thread);
  }
  // A thread of timers alone serves the same nodes as another one: release-and-execute.
  for (std::uint32_t a = 0; a < uses.size(); ++a) {
    for (std::uint32_t b = 0; b < uses.size(); ++b) {
      const bool apart = uses[a].timers && !uses[a].others && uses[b].others && !uses[b].timers;
      if (!apart || system.threads[a].waits + system.threads[b].waits > 0) continue;
      if (std::ranges::any_of(uses[a].nodes, [&](std::uint32_t n) { return uses[b].nodes.contains(n); }))
        groups.join(b, a);
    }
  }
  RecordedExecutors found;
  std::map<std::uint32_t, std::uint32_t> index;
  for (std::uint32_t t = 0; t < system.threads.size(); ++t) {
    if (uses[t].nodes.empty()) continue;
    const auto [at, is_new] =
        index.try_emplace(groups.find(t), static_cast<std::uint32_t>(found.executors.size()));
    if (is_new)
      found.executors.push_back(
          {concat("thread_", system.threads[t].id), system.threads[t].process, {}, {}, {}});
    found.executors[at->second].threads.push_back(t);
  }
  for (RecordedExecutor& executor : found.executors) {
    find_candidates(system, uses, executor);
    if (given.empty()) continue;
    executor.candidates = {given};
    executor.why = "--executor says so";
  }
  for (std::uint32_t c = 0; c < system.callbacks.size(); ++c) {
    const bool ran = counts(system, c);
    found.of_callback.push_back(ran ? index.at(groups.find(system.callbacks[c].threads.begin()->first))
                                    : kNone);
  }
  return found;
}

std::vector<std::int32_t> usual_processors(const RecordedThread& thread) {
  std::vector<std::int32_t> usual;
  for (const auto& [processor, jobs] : thread.processors)
    if (100 * jobs >= thread.jobs) usual.push_back(processor);
  return usual;
}

namespace {

/// How often jobs of one thread met those of another one on one processor.
struct Meetings {
  std::uint32_t within = 0;  ///< Lay within its job: displaced it.
  std::uint32_t waited = 0;  ///< Were ready during its job and began after it.
};

/// Few exceptions do not count: also threads of the ordinary policy displace each other.
bool is_above(const Meetings& of, const Meetings& other) {
  return of.within > 3 && of.within > 10 * other.within;
}
bool waits_for(const Meetings& of) { return of.waited > 4 && of.waited > 20 * of.within; }

}  // namespace

Displacement recorded_displacement(const RecordedSystem& system, const RecordedWindow& window) {
  const std::size_t threads = system.threads.size();
  Displacement found{std::vector<Duration>(window.jobs.size()), std::vector<int>(threads, 0)};
  std::vector<std::vector<Meetings>> met(threads, std::vector<Meetings>(threads));
  std::map<std::int32_t, std::vector<std::size_t>> open;                // by processor
  std::map<std::int32_t, std::map<std::uint32_t, std::size_t>> latest;  // by processor and thread
  std::vector<Time> idle_since(threads, Time::min());
  for (std::size_t i = 0; i < window.jobs.size(); ++i) {
    const RecordedJob& job = window.jobs[i];
    if (!job.ended) continue;
    found.own[i] = job.finish - job.start;
    std::vector<std::size_t>& others = open[job.processor];
    std::erase_if(others, [&](std::size_t o) { return window.jobs[o].finish <= job.start; });
    // The innermost one alone had the processor.
    for (auto outer = others.rbegin(); outer != others.rend(); ++outer) {
      const RecordedJob& displaced = window.jobs[*outer];
      if (displaced.thread == job.thread || displaced.finish < job.finish) continue;
      found.own[*outer] -= job.finish - job.start;
      ++met[job.thread][displaced.thread].within;
      break;
    }
    others.push_back(i);
    if (window.records[i].job.task != kNoTask) {
      const Time ready = window.records[i].job.timestamp;
      for (const auto& [thread, last] : latest[job.processor]) {
        const RecordedJob& before = window.jobs[last];
        const bool during = thread != job.thread && before.start < ready && ready < before.finish;
        if (during && idle_since[job.thread] < ready && before.finish <= job.start)
          ++met[job.thread][thread].waited;
      }
    }
    latest[job.processor][job.thread] = i;
    idle_since[job.thread] = std::max(idle_since[job.thread], job.finish);
  }
  constexpr int kMostLevels = 9;
  for (std::size_t round = 0; round < threads; ++round) {
    for (std::size_t a = 0; a < threads; ++a) {
      for (std::size_t b = 0; b < threads; ++b) {
        int& level = found.level[a];
        if (is_above(met[a][b], met[b][a]))
          level = std::max(level, std::min(found.level[b] + 1, kMostLevels));
        if (waits_for(met[b][a])) level = std::max({level, found.level[b], 1});
      }
    }
  }
  return found;
}

RecordedCosts recorded_costs(const RecordedGraph& graph, const RecordedWindow& window,
                             const RecordedExecutor& executor, const ExecutorEntry& entry) {
  std::vector<std::size_t> place(graph.tasks.set.size());
  for (TaskId id = 0; id < place.size(); ++id)
    place[id] = entry.traits.runs_first == graph.tasks.set[id].kind ? id : id + place.size();
  const bool wait_set = entry.traits.family == Family::wait_set;
  const bool tells_waits = std::ranges::any_of(window.jobs, [&](const RecordedJob& job) {
    return job.waited && std::ranges::find(executor.threads, job.thread) != executor.threads.end();
  });
  // A timer's releaser wakes the thread that runs its job.
  const TimerHandling timers = entry.traits.timers;
  const bool two_wake_ups = timers == TimerHandling::release_only || timers == TimerHandling::marked_ready;
  std::map<std::int32_t, Time> busy_until;        // by processor: by the jobs before the one at hand
  std::map<std::uint32_t, std::size_t> previous;  // by thread
  std::map<std::uint32_t, Time> group_until;      // by callback group: by its jobs before the one at hand
  std::vector<Duration> dispatch, wait, wake_up, delivery;
  for (std::size_t i = 0; i < window.jobs.size(); ++i) {
    if (i > 0 && window.jobs[i - 1].ended) {
      Time& until = busy_until[window.jobs[i - 1].processor];
      until = std::max(until, window.jobs[i - 1].finish);
    }
    const RecordedJob& job = window.jobs[i];
    if (!job.ended || std::ranges::find(executor.threads, job.thread) == executor.threads.end()) continue;
    const auto before = previous.find(job.thread);
    const bool has_previous = before != previous.end();
    const std::size_t last = has_previous ? before->second : i;
    previous[job.thread] = i;
    const TaskId task = window.records[i].job.task;
    if (task == kNoTask) continue;
    const Time timestamp = window.records[i].job.timestamp;
    Time& of_group = group_until[graph.tasks.set[task].group];
    const Time group_free = std::exchange(of_group, std::max(of_group, job.finish));
    if (!has_previous) continue;
    // It waited for its callback group, which another thread served.
    if (group_free > std::max(timestamp, window.jobs[last].finish)) continue;
    const Duration gap = job.start - window.jobs[last].finish;
    if (gap < Duration::zero()) continue;  // one within the other
    if (timestamp <= window.jobs[last].finish) {
      const TaskId other = window.records[last].job.task;
      const bool new_round = other != kNoTask && place[task] <= place[other];
      const bool waited = wait_set && (tells_waits ? job.waited : new_round);
      (waited ? wait : dispatch).push_back(gap);
    } else {
      // Another job on the processor made it wait, not the wake-up.
      if (busy_until[job.processor] > timestamp) continue;
      const bool timer = graph.tasks.set[task].kind == TaskKind::timer;
      const Duration late = job.start - timestamp;
      wake_up.push_back(timer && two_wake_ups ? late / 2 : late);
      if (!timer) delivery.push_back(late);
    }
  }
  RecordedCosts costs;
  costs.dispatch = cost_of(std::move(dispatch), Duration::zero());
  costs.wait = cost_of(std::move(wait), costs.dispatch.median);
  costs.wake_up = cost_of(std::move(wake_up), costs.dispatch.median);
  costs.delivery = cost_of(std::move(delivery), costs.dispatch.median);
  return costs;
}

Precedence recorded_precedence(const RecordedGraph& graph, const RecordedWindow& window, bool wait_sets) {
  const TaskId count = graph.tasks.set.size();
  Precedence found{{count, std::vector<std::uint32_t>(count, 0)}, 0};
  std::uint64_t pairs = 0, contradicting = 0;
  const auto in_order = [&](std::vector<TaskId>& together, TaskId task) {
    for (const TaskId other : together) {
      if (other == task || graph.tasks.set[task].kind != graph.tasks.set[other].kind) continue;
      ++found.before[other][task];
      ++pairs;
      contradicting += other > task;
    }
    together.push_back(task);
  };
  std::map<std::uint32_t, Time> started;  // by node: its latest job
  const bool snapshots_known = wait_sets && std::ranges::any_of(window.jobs, &RecordedJob::waited);
  std::map<std::uint32_t, std::vector<TaskId>> snapshots;                   // by thread
  std::map<std::pair<TaskId, std::uint64_t>, std::vector<TaskId>> readers;  // by publishing job
  for (std::size_t i = 0; i < window.jobs.size(); ++i) {
    const Job& job = window.records[i].job;
    if (snapshots_known) {
      std::vector<TaskId>& snapshot = snapshots[window.jobs[i].thread];
      if (window.jobs[i].waited) snapshot.clear();
      if (job.task != kNoTask) in_order(snapshot, job.task);
    } else if (job.task != kNoTask && job.parent.task != kNoTask) {
      // A node that had another job since was in the queue already.
      const auto last = started.find(graph.tasks.origin[job.task].node);
      if (last == started.end() || last->second < job.timestamp)
        in_order(readers[{job.parent.task, job.parent.sequence}], job.task);
    }
    if (job.task != kNoTask) started[graph.tasks.origin[job.task].node] = window.jobs[i].start;
  }
  if (pairs > 0) found.contradicting = static_cast<double>(contradicting) / static_cast<double>(pairs);
  return found;
}

namespace {

/// Again and again the first item that none of those left comes before on balance; if there is none, that
/// with the least balance. `ahead(a, b)`: by how much a comes before b.
template <class Ahead>
std::vector<std::uint32_t> in_order(std::vector<std::uint32_t> left, Ahead&& ahead) {
  std::vector<std::uint32_t> order;
  while (!left.empty()) {
    const auto behind = [&](std::uint32_t item) {
      std::int64_t sum = 0;
      for (const std::uint32_t other : left)
        if (other != item) sum += std::max<std::int64_t>(0, ahead(other, item));
      return sum;
    };
    const auto first = std::ranges::min_element(left, {}, behind);
    order.push_back(*first);
    left.erase(first);
  }
  return order;
}

}  // namespace

ServiceOrder service_order(const RecordedSystem& system, const RecordedGraph& graph,
                           const Precedence& precedence) {
  const std::size_t nodes = system.nodes.size();
  std::vector<std::vector<std::int64_t>> of_nodes(nodes, std::vector<std::int64_t>(nodes, 0));
  const auto task = [&](std::uint32_t c) { return graph.task_of[c]; };
  const auto ahead = [&](std::uint32_t a, std::uint32_t b) -> std::int64_t {
    return std::int64_t{precedence.before[task(a)][task(b)]} -
           std::int64_t{precedence.before[task(b)][task(a)]};
  };
  std::vector<std::uint32_t> callbacks, all_nodes(nodes);
  for (std::uint32_t c = 0; c < graph.task_of.size(); ++c)
    if (task(c) != kNoTask) callbacks.push_back(c);
  std::iota(all_nodes.begin(), all_nodes.end(), 0U);
  for (const std::uint32_t a : callbacks)
    for (const std::uint32_t b : callbacks)
      of_nodes[system.callbacks[a].node][system.callbacks[b].node] += ahead(a, b);
  return {in_order(all_nodes, [&](std::uint32_t a, std::uint32_t b) { return of_nodes[a][b]; }),
          in_order(callbacks, [&](std::uint32_t a, std::uint32_t b) {
            return system.callbacks[a].node == system.callbacks[b].node ? ahead(a, b) : 0;
          })};
}

}  // namespace hotpath
