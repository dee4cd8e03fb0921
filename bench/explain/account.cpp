// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>

#include "explain/explainer.hpp"

namespace hotpath::explain {

namespace {

/// An interval for which a job had a thread or a processor.
struct Held {
  Time from, to;
  const Seen* by;
};

/// Passes the intervals of [from, to) that jobs held, which are in order of start, to `held`, and what lies
/// between them to `between`; also before a job that took no time, since its dispatch did.
void divide(Time from, Time to, const std::vector<Held>& all, const auto& between, const auto& held) {
  for (const Held& h : all) {
    const Time begin = std::max(from, h.from), end = std::min(h.to, to);
    if (end < begin) continue;
    if (begin > from) between(from, begin);
    held(*h.by, begin, end);
    from = end;
  }
  if (to > from) between(from, to);
}

std::vector<Held> held_by(const Jobs& jobs, const auto& counts) {
  std::vector<Held> held;
  for (const Seen* const job : jobs)
    if (counts(*job)) held.push_back({job->start, job->finish, job});
  return held;
}

/// A job that waits.
struct Waiting {
  const Seen& job;
  std::size_t step;
  const Seen* before;  ///< Its predecessor on the path; until it has finished, the path runs.
  const ServingExecutor& executor;
  bool of_wait_set, timer = false;
  Time arrival{};       ///< When the executor could know of the job.
  Time snapshot{};      ///< Wait sets: the poll that found it, or the older sample.
  const Seen* older{};  ///< The first older job of its task that started after the arrival.

  [[nodiscard]] bool follows(const Seen& other) const {
    return before != nullptr && other.order == before->order;
  }
};

/// Divides intervals of a latency among causes. Every call accounts for all of its interval.
struct Account {
  const System& system;
  const JobWindow& window;
  const ExecutionTimes* times;
  std::vector<Part> parts = {};

  /// The job `step` of the path runs in [from, to).
  void run(const Seen& job, std::size_t step, Time from, Time to) {
    spend(job, from, to, step, {}, [&](Duration ran) { add(Cause::running, step, ran); });
  }

  /// It waits in [from, to), before its start; until `before`, its predecessor on the path, has
  /// finished, that job runs on the path.
  void wait(const Seen& job, std::size_t step, Time from, Time to, const Seen* before) {
    const Waiting w = waiting(job, step, before);
    const auto is_other = [&](const Seen& other) { return other.order != job.order; };
    const auto in_group = [&](const Seen& other) {
      return other.finish != other.start && system.share_group(other.job.task, job.job.task);
    };
    const auto on_core = [&](Time begin, Time end) {
      divide(
          begin, end, held_by(window.of_worker(job.worker, begin, end, true), in_group),
          [&](Time a, Time b) { idle(w, a, b); },
          [&](const Seen& other, Time a, Time b) {
            if (w.follows(other)) return add(Cause::running, step - 1, b - a);
            add(Cause::executor, step, b - a, other.job.ref(), Rule::same_group);
          });
    };
    const auto without_job = [&](Time begin, Time end) {
      divide(begin, end, displaced(job, Time::min(), begin, end), on_core,
             [&](const Seen& by, Time a, Time b) { add(Cause::displaced, step, b - a, by.job.ref()); });
    };
    divide(from, to, held_by(window.of_worker(job.worker, from, to), is_other), without_job,
           [&](const Seen& other, Time a, Time b) {
             spend(other, a, b, step, other.job.ref(), [&](Duration ran) { behind(w, other, ran); });
           });
  }

  /// All of an interval.
  void add(Cause cause, std::size_t step, Duration length, JobRef behind = {}, Rule rule = Rule::none) {
    if (length <= Duration{}) return;
    const Part part{cause, rule, behind, step, length};
    const auto kind = [](const Part& p) { return std::tuple(p.cause, p.rule, p.step, p.behind); };
    if (parts.empty() || kind(parts.back()) != kind(part))
      parts.push_back(part);
    else
      parts.back().length += length;
  }

  /// How a thread that had a job to run in [from, to) spent this time, in order as far as it is known.
  /// `running` gets the time for which it had the processor; `withheld`: the job to name for time without.
  void spend(const Seen& job, Time from, Time to, std::size_t step, JobRef withheld, const auto& running) {
    if (to <= from) return;
    const bool whole = job.outcome == Outcome::ran && from == job.start && to == job.finish;
    // The time for which the thread had no processor, where the execution time is known.
    std::optional<Duration> off;
    if (whole && job.cpu_time >= Duration{}) off = std::max(Duration{}, to - from - job.cpu_time);
    if (whole && times != nullptr) off = std::max(Duration{}, to - from - times->of(job.job));
    std::vector<Held> held = displaced(job, job.start, from, to);
    // Jobs that work until an instant of the clock are not prolonged by time without a processor.
    if (!off && system.wall_clock_work) held.clear();
    Duration on_core = to - from;
    for (Held& h : held) {
      if (off) h.to = std::min(h.to, h.from + *off);
      if (off) *off -= h.to - h.from;
      on_core -= h.to - h.from;
    }
    // In a part of a job, the thread had the processor for no longer than in all of it.
    if (!whole && !system.simulated && job.cpu_time >= Duration{})
      off = std::max(Duration{}, on_core - job.cpu_time);
    on_core -= off.value_or(Duration{});
    for (const Held& h : held) {
      const Duration ran = std::min(on_core, h.from - std::exchange(from, h.to));
      running(ran);
      add(Cause::displaced, step, h.to - h.from, h.by->job.ref());
      on_core -= ran;
    }
    running(on_core);
    // Releases of the timer thread are not in the trace.
    if (system.simulated) withheld = {};
    add(system.simulated ? Cause::displaced : Cause::withheld, step, off.value_or(Duration{}), withheld);
  }

  /// When jobs of other threads kept the thread of `job`, busy since `since`, from its processor.
  [[nodiscard]] std::vector<Held> displaced(const Seen& job, Time since, Time from, Time to) const {
    Jobs others = window.of_worker(job.worker, from, to, true);
    std::erase_if(others, [&](const Seen* other) {
      const bool shares_core = system.simulated || (job.cpu >= 0 && other->cpu == job.cpu);
      return !shares_core || !system.outranks(other->worker, other->start, job.worker, since);
    });
    const std::size_t cores = system.simulated ? system.cores_of(job.worker) : 1;
    std::vector<Held> held;
    if (others.size() < cores) return held;
    std::vector<Time> instants = {from, to};
    for (const Seen* const other : others)
      for (const Time at : {other->start, other->finish}) instants.push_back(std::clamp(at, from, to));
    std::ranges::sort(instants);
    for (std::size_t i = 0; i + 1 < instants.size(); ++i) {
      if (instants[i] == instants[i + 1]) continue;
      std::size_t running = 0;
      const Seen* latest = nullptr;
      for (const Seen* const other : others) {
        if (other->start > instants[i] || other->finish <= instants[i]) continue;
        ++running;
        if (latest == nullptr || other->order > latest->order) latest = other;
      }
      if (running >= cores && running > 0) held.push_back({instants[i], instants[i + 1], latest});
    }
    return held;
  }

  [[nodiscard]] Waiting waiting(const Seen& job, std::size_t step, const Seen* before) const {
    const TaskId task = job.job.task;
    const ServingExecutor& executor = system.executor_of(task);
    const ExecutorTraits& traits = executor.traits;
    Waiting w{job, step, before, executor, traits.family == Family::wait_set};
    w.timer = system.task(task).kind == TaskKind::timer;
    // The stock executor's timer thread takes a due timer from no queue.
    const bool polled = w.of_wait_set || (w.timer && traits.family == Family::events &&
                                          traits.timers == TimerHandling::release_and_execute);
    w.arrival = polled ? job.job.timestamp + (w.timer ? Duration{} : system.delivery)
                       : std::max(job.job.release, job.job.timestamp);
    w.arrival = std::clamp(w.arrival, std::min(job.job.timestamp, job.start), job.start);
    w.snapshot = job.job.release;
    const std::deque<Seen>& own = window.of_task(task);
    for (auto other = own.rbegin(); other != own.rend() && other->finish > w.arrival; ++other) {
      if (other->order >= job.order || other->start < w.arrival || other->job.sequence > job.job.sequence)
        continue;
      w.older = &*other;
      w.snapshot = other->job.release;
    }
    return w;
  }

  /// The worker that will run the job runs another one.
  void behind(const Waiting& w, const Seen& other, Duration length) {
    const JobRef ref = other.job.ref();
    if (w.follows(other)) return add(Cause::running, w.step - 1, length);
    if (ref.task == w.job.job.task) return add(Cause::older_sample, w.step, length, ref);
    // A snapshot holds one sample of a subscription: this one waits until the next poll.
    const bool after_older = w.of_wait_set && w.older != nullptr && other.start >= w.older->start &&
                             other.start < w.job.job.release;
    if (after_older) return add(Cause::older_sample, w.step, length, ref, Rule::snapshot_order);
    const Rule by = rule(w, other);
    add(by == Rule::earlier_snapshot ? Cause::snapshot : Cause::executor, w.step, length, ref, by);
  }

  /// Why the executor ran `first` before the waiting job.
  [[nodiscard]] Rule rule(const Waiting& w, const Seen& first) const {
    const ExecutorTraits& traits = w.executor.traits;
    if (first.start < w.arrival) {
      const bool was_running = first.start <= w.job.job.timestamp || first.finish > w.arrival;
      return was_running ? Rule::already_running : Rule::before_release;
    }
    // Other threads were free to run it.
    if (w.executor.many_threads() && system.share_group(first.job.task, w.job.job.task))
      return Rule::same_group;
    if (w.of_wait_set) {
      if (system.kind == results::RunKind::recorded) return Rule::recorded;  // traces lack the snapshots
      if (first.start < w.snapshot) return Rule::earlier_snapshot;
      const Task &ahead = system.task(first.job.task), &waits = system.task(w.job.job.task);
      const TaskKind first_kind = traits.runs_first.value_or(TaskKind::timer);
      if (place_of_kind(ahead, first_kind) >= place_of_kind(waits, first_kind)) return Rule::snapshot_order;
      const bool timers_first = first_kind == TaskKind::timer;
      if (ahead.entity != EntityKind::subscription || waits.entity != EntityKind::subscription ||
          ahead.kind == waits.kind)
        return timers_first ? Rule::kinds : Rule::static_kinds;
      return timers_first ? Rule::timers_first : Rule::subscriptions_first;
    }
    const bool other_group = system.task(first.job.task).group != system.task(w.job.job.task).group;
    if (traits.family == Family::callback_groups) return other_group ? Rule::group_order : Rule::fifo;
    return w.executor.order ? rule_of_queue(w, first) : Rule::fifo;
  }

  /// The same for a queue with priorities.
  [[nodiscard]] Rule rule_of_queue(const Waiting& w, const Seen& first) const {
    // Activations are counted in the order of the releases.
    const auto key_of = [&](const Job& job) {
      return w.executor.order->key(job, static_cast<std::uint64_t>(to_ns(job.release)));
    };
    const PriorityKey theirs = key_of(first.job), its = key_of(w.job.job);
    const bool waited = w.executor.service_wait > Duration{} && system.task(first.job.task).service &&
                        first.start - first.job.release >= w.executor.service_wait;
    if (waited && theirs > its) return Rule::service_wait;
    if (theirs.priority == its.priority) return Rule::tie;
    // It was chosen before, and was still being dispatched.
    if (theirs.priority > its.priority) return Rule::before_release;
    return by_deadline(traits_of(w.executor.traits.queue_order()).levels) ? Rule::deadline : Rule::priority;
  }

  /// No job that was recorded kept the waiting job from starting.
  void idle(const Waiting& w, Time from, Time to) {
    const Time arrival = w.timer ? from : std::clamp(w.arrival, from, to);
    add(Cause::delivery, w.step, arrival - from);
    const Duration left = to - arrival;
    const Duration second = w.timer ? w.executor.second_wake_up : Duration{};
    const Duration overhead = std::min(left, w.executor.most_overhead.value_or(left) + second);
    add(Cause::overhead, w.step, overhead);
    // An idle thread waits for a wait set that was built before.
    const bool old_wait_set = w.of_wait_set && w.executor.many_threads() && from < w.job.job.release;
    add(old_wait_set ? Cause::snapshot : Cause::unexplained, w.step, left - overhead);
  }
};

}  // namespace

/// A cyclic node may read data that arrived after its job's start, where the hot path ends.
std::vector<Part> parts_of_path(const System& system, const JobWindow& window, const ExecutionTimes* times,
                                const Jobs& path, Time begin, Latency latency) {
  Account account{system, window, times};
  const Seen &source = *path.front(), &sink = *path.back();
  const Time end = std::max(begin, sink.start);
  Time done = std::clamp(source.start, begin, end);
  source.job.timestamp == begin ? account.wait(source, 0, begin, done, nullptr)
                                : account.add(Cause::unexplained, 0, done - begin);
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Seen &job = *path[i], &next = *path[i + 1];
    const Time until = std::clamp(next.start, done, end);
    const bool direct = next.job.parent == job.job.ref();
    // The rest of the job, after the publication, counts as running while the next job waits for it.
    const Time handed_over = direct && job.worker != next.worker ? next.job.timestamp : job.finish;
    const Time ran = std::clamp(handed_over, done, until);
    account.run(job, i, done, ran);
    const Time ready = direct ? ran : std::clamp(next.job.timestamp, ran, until);
    account.add(Cause::join, i + 1, ready - ran);
    account.wait(next, i + 1, ready, until, &job);
    done = until;
  }
  if (latency != Latency::hot_path) account.run(sink, path.size() - 1, end, sink.finish);
  return account.parts;
}

}  // namespace hotpath::explain
