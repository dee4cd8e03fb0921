// SPDX-License-Identifier: Apache-2.0
#include "explain/account.hpp"

#include <algorithm>
#include <utility>

namespace hotpath::explain {

void Account::add(Cause cause, std::size_t step, Duration length, JobRef behind, Rule rule) {
  if (length <= Duration{}) return;
  if (!parts_.empty()) {
    Part& last = parts_.back();
    if (last.cause == cause && last.step == step && last.behind == behind && last.rule == rule) {
      last.length += length;
      return;
    }
  }
  parts_.push_back({cause, rule, behind, step, length});
}

/// How a thread that had a job to run in [from, to) spent this time, in order as far as it is known.
std::vector<Account::Spent> Account::spent(const JobRecord& job, Time from, Time to) const {
  const bool simulated = system_.kind() == results::RunKind::simulated;
  const bool whole = job.outcome == Outcome::ran && from == job.start && to == job.finish;
  // The time for which the thread had no processor, where the execution time is known.
  std::optional<Duration> off;
  if (whole && job.cpu_time >= Duration{}) off = std::max(Duration{}, to - from - job.cpu_time);
  if (whole && times_ != nullptr) off = std::max(Duration{}, to - from - times_->of(job.job));
  std::vector<Held> held = displaced(job, job.start, from, to);
  // Jobs that work until an instant of the clock are not prolonged by time without a processor.
  if (!off && system_.wall_clock_work()) held.clear();
  Duration on_core = to - from;
  for (Held& h : held) {
    if (off) h.to = std::min(h.to, h.from + *off);
    if (off) *off -= h.to - h.from;
    on_core -= h.to - h.from;
  }
  // In a part of a job, the thread had the processor for no longer than in all of it.
  if (!whole && !simulated && job.cpu_time >= Duration{}) off = std::max(Duration{}, on_core - job.cpu_time);
  on_core -= off.value_or(Duration{});
  std::vector<Spent> spent;
  Time done = from;
  for (const Held& h : held) {
    const Duration ran = std::min(on_core, h.from - done);
    spent.push_back({Cause::running, ran, {}});
    spent.push_back({Cause::displaced, h.to - h.from, h.by});
    on_core -= ran;
    done = h.to;
  }
  spent.push_back({Cause::running, on_core, {}});
  // Releases of the timer thread are not in the trace.
  spent.push_back({simulated ? Cause::displaced : Cause::withheld, off.value_or(Duration{}), {}});
  return spent;
}

void Account::run(const JobRecord& job, std::size_t step, Time from, Time to) {
  if (to <= from) return;
  for (const Spent& s : spent(job, from, to)) add(s.cause, step, s.length, s.by);
}

bool Account::shares_core(const JobRecord& other, const JobRecord& job) const {
  return system_.kind() == results::RunKind::simulated || (job.cpu >= 0 && other.cpu == job.cpu);
}

/// When jobs of other threads kept the thread of `job`, busy since `since`, from its processor.
std::vector<Account::Held> Account::displaced(const JobRecord& job, Time since, Time from, Time to) const {
  std::vector<const Seen*> others;
  for (std::size_t worker = 0; worker < window_.workers(); ++worker) {
    if (worker == job.worker) continue;
    for (const Seen* other : window_.overlapping(worker, from, to)) {
      const JobRecord& r = other->record;
      if (shares_core(r, job) && system_.outranks(worker, r.start, job.worker, since))
        others.push_back(other);
    }
  }
  const std::size_t cores = system_.kind() == results::RunKind::simulated ? system_.cores_of(job.worker) : 1;
  std::vector<Held> held;
  if (others.size() < cores) return held;
  std::vector<Time> instants = {from, to};
  for (const Seen* other : others) {
    instants.push_back(std::clamp(other->record.start, from, to));
    instants.push_back(std::clamp(other->record.finish, from, to));
  }
  std::ranges::sort(instants);
  for (std::size_t i = 0; i + 1 < instants.size(); ++i) {
    if (instants[i] == instants[i + 1]) continue;
    std::size_t running = 0;
    const Seen* latest = nullptr;
    for (const Seen* other : others) {
      if (other->record.start > instants[i] || other->record.finish <= instants[i]) continue;
      ++running;
      if (latest == nullptr || other->order > latest->order) latest = other;
    }
    if (running >= cores && running > 0)
      held.push_back({instants[i], instants[i + 1], latest->record.job.ref()});
  }
  return held;
}

Account::Waiting Account::waiting(const Seen& seen, std::size_t step, const JobRecord* before) const {
  const JobRecord& job = seen.record;
  const ServingExecutor& executor = system_.executor_of(job.job.task);
  const ExecutorTraits& traits = executor.traits;
  Waiting w{job, step, executor, before, {}, {}, nullptr};
  const bool timer = system_.task(job.job.task).kind == TaskKind::timer;
  // The stock executor's timer thread takes a due timer from no queue.
  const bool polled =
      traits.family == Family::wait_set ||
      (timer && traits.family == Family::events && traits.timers == TimerHandling::release_and_execute);
  w.arrival = polled ? job.job.timestamp + (timer ? Duration{} : system_.delivery())
                     : std::max(job.job.release, job.job.timestamp);
  w.arrival = std::clamp(w.arrival, std::min(job.job.timestamp, job.start), job.start);
  w.snapshot = job.job.release;
  const std::deque<Seen>& own = window_.of_task(job.job.task);
  for (auto other = own.rbegin(); other != own.rend() && other->record.finish > w.arrival; ++other) {
    const JobRecord& r = other->record;
    if (other->order >= seen.order || r.start < w.arrival || r.job.sequence > job.job.sequence) continue;
    w.older = &r;
    w.snapshot = r.job.release;
  }
  return w;
}

void Account::wait(const Seen& job, std::size_t step, Time from, Time to, const JobRecord* before) {
  const Waiting w = waiting(job, step, before);
  Time done = from;
  for (const Seen* other : window_.overlapping(job.record.worker, from, to)) {
    if (other->order == job.order) continue;
    const Time begin = std::max(done, other->record.start), end = std::min(other->record.finish, to);
    if (end < begin) continue;
    gap(w, done, begin);  // also before a job that took no time: its dispatch did
    behind(w, other->record, begin, end);
    done = end;
  }
  gap(w, done, to);
}

void Account::behind(const Waiting& w, const JobRecord& other, Time from, Time to) {
  for (const Spent& s : spent(other, from, to)) {
    if (s.cause == Cause::running) {
      behind_on_core(w, other, s.length);
    } else {
      add(s.cause, w.step, s.length, s.cause == Cause::withheld ? other.job.ref() : s.by);
    }
  }
}

void Account::behind_on_core(const Waiting& w, const JobRecord& other, Duration length) {
  const JobRef ref = other.job.ref();
  const bool wait_set = w.executor.traits.family == Family::wait_set;
  if (w.before != nullptr && ref == w.before->job.ref()) return add(Cause::running, w.step - 1, length);
  if (ref.task == w.job.job.task) return add(Cause::older_sample, w.step, length, ref);
  // A snapshot holds one sample of a subscription: this one waits until the next poll.
  const bool after_older =
      wait_set && w.older != nullptr && other.start >= w.older->start && other.start < w.job.job.release;
  if (after_older) return add(Cause::older_sample, w.step, length, ref, Rule::snapshot_order);
  const Rule by = rule(w, other);
  add(by == Rule::earlier_snapshot ? Cause::snapshot : Cause::executor, w.step, length, ref, by);
}

/// Why the executor ran `first` before the waiting job.
Rule Account::rule(const Waiting& w, const JobRecord& first) const {
  const ExecutorTraits& traits = w.executor.traits;
  if (first.start < w.arrival) {
    const bool was_running = first.start <= w.job.job.timestamp || first.finish > w.arrival;
    return was_running ? Rule::already_running : Rule::before_release;
  }
  // Other threads were free to run it.
  if (w.executor.many_threads && system_.share_group(first.job.task, w.job.job.task)) return Rule::same_group;
  const TaskKind kind = system_.task(first.job.task).kind, own = system_.task(w.job.job.task).kind;
  if (traits.family == Family::wait_set) {
    if (system_.kind() == results::RunKind::recorded)
      return Rule::recorded;  // traces do not tell the snapshots
    if (first.start < w.snapshot) return Rule::earlier_snapshot;
    if (kind == own || traits.runs_first != kind) return Rule::snapshot_order;
    return kind == TaskKind::timer ? Rule::timers_first : Rule::subscriptions_first;
  }
  if (traits.family == Family::callback_groups) return Rule::group_order;
  if (!w.executor.order) return Rule::fifo;
  // Activations are counted in the order of the releases.
  const auto key_of = [&](const Job& job) {
    return w.executor.order->key(job, static_cast<std::uint64_t>(to_ns(job.release)));
  };
  const PriorityKey theirs = key_of(first.job), its = key_of(w.job.job);
  const bool waited = w.executor.service_wait > Duration{} && system_.task(first.job.task).guaranteed &&
                      first.start - first.job.release >= w.executor.service_wait;
  if (waited && theirs > its) return Rule::service_wait;
  if (theirs.priority == its.priority) return Rule::tie;
  if (theirs.priority > its.priority)
    return Rule::before_release;  // chosen before, and still being dispatched
  return levels_of(traits.policy.value_or(Policy::fifo)) == Levels::deadline ? Rule::deadline
                                                                             : Rule::priority;
}

/// The worker that will run the job has none.
void Account::gap(const Waiting& w, Time from, Time to) {
  if (to <= from) return;
  Time done = from;
  for (const Held& held : displaced(w.job, Time::min(), from, to)) {
    gap_on_core(w, done, held.from);
    add(Cause::displaced, w.step, held.to - held.from, held.by);
    done = held.to;
  }
  gap_on_core(w, done, to);
}

void Account::gap_on_core(const Waiting& w, Time from, Time to) {
  if (to <= from) return;
  std::vector<const Seen*> same_group;
  for (std::size_t worker = 0; worker < window_.workers(); ++worker) {
    if (worker == w.job.worker) continue;
    for (const Seen* other : window_.overlapping(worker, from, to)) {
      if (system_.share_group(other->record.job.task, w.job.job.task)) same_group.push_back(other);
    }
  }
  std::ranges::sort(same_group, {}, &Seen::order);
  Time done = from;
  for (const Seen* other : same_group) {
    const Time begin = std::max(done, other->record.start), end = std::min(to, other->record.finish);
    if (end <= begin) continue;
    idle(w, done, begin);
    const JobRef ref = other->record.job.ref();
    if (w.before != nullptr && ref == w.before->job.ref()) {
      add(Cause::running, w.step - 1, end - begin);
    } else {
      add(Cause::executor, w.step, end - begin, ref, Rule::same_group);
    }
    done = end;
  }
  idle(w, done, to);
}

/// No job that was recorded kept the waiting job from starting.
void Account::idle(const Waiting& w, Time from, Time to) {
  if (to <= from) return;
  const bool timer = system_.task(w.job.job.task).kind == TaskKind::timer;
  const Time arrival = std::clamp(w.arrival, from, to);
  if (!timer) add(Cause::delivery, w.step, arrival - from);
  const Duration left = to - (timer ? from : arrival);
  Duration overhead = left;
  if (w.executor.most_overhead) {
    overhead = std::min(left, *w.executor.most_overhead + (timer ? w.executor.second_wake_up : Duration{}));
  }
  add(Cause::overhead, w.step, overhead);
  // An idle thread waits for a wait set that was built before.
  const bool old_wait_set =
      w.executor.traits.family == Family::wait_set && w.executor.many_threads && from < w.job.job.release;
  add(old_wait_set ? Cause::snapshot : Cause::unexplained, w.step, left - overhead);
}

}  // namespace hotpath::explain
