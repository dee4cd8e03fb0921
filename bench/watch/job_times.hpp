// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "hotpath/core/timer.hpp"
#include "hotpath/tracing/system.hpp"
#include "watch/thread_facts.hpp"

namespace hotpath::watch {

/// A job that has started.
struct RunningJob {
  tracing::JobRef ref;
  std::uint32_t thread = 0;
  std::int32_t processor = -1;
  Time start{};
  std::optional<Time> timestamp = {};  ///< std::nullopt: unknown.
  Duration displaced{};                ///< By jobs of other threads that have ended.
  std::optional<Time> overdue = {};    ///< Since when, without the jobs that displaced it.
  Duration judged{};                   ///< Its length when it was found to be overdue.
};

/// The jobs that have started and not ended, of all threads. A job that starts on the processor of
/// another thread's job displaces it.
struct RunningJobs {
  void start(const tracing::Job& job, std::optional<Time> timestamp) {
    jobs.push_back({job.ref, job.thread, job.processor, job.start, timestamp});
  }

  /// Ends a job; of one that is unknown, nothing is known. By what it was displaced is unknown, too, if it
  /// changed its processor.
  RunningJob end(const tracing::Job& job) {
    const auto at = std::ranges::find(jobs, job.ref, &RunningJob::ref);
    if (at == jobs.end()) return {};
    RunningJob ended = *at;
    jobs.erase(at);
    if (!job.ended || job.processor != ended.processor) {
      ended.displaced = {};
      return ended;
    }
    for (RunningJob& other : jobs)
      if (displaces(ended, other)) other.displaced += job.finish - ended.start - ended.displaced;
    return ended;
  }

  /// Since when a running job would have run without other jobs; std::nullopt: one displaces it now.
  [[nodiscard]] std::optional<Time> undisplaced_start(const RunningJob& job) const {
    if (std::ranges::any_of(jobs, [&](const RunningJob& other) { return displaces(other, job); }))
      return std::nullopt;
    return job.start + job.displaced;
  }

  static bool displaces(const RunningJob& job, const RunningJob& other) {
    return job.processor >= 0 && job.processor == other.processor && job.thread != other.thread &&
           job.start >= other.start;
  }

  std::vector<RunningJob> jobs = {};  ///< In the order of their starts.
};

/// The timestamps of jobs as they start. Those of timers are derived from creation and period by rcl's
/// rules, unless the executor states them. Memory is bounded by the number of callbacks and threads.
class Timestamps {
 public:
  /// `attached`: the jobs before this instant are unknown.
  explicit Timestamps(std::optional<Time> attached) : attached_(attached) {}

  // In the order of time: the thread waits for work, a job starts, a job ends.
  void waits(const ThreadKey& thread, Time at) {
    Rounds& rounds = rounds_[thread];
    rounds.waits = true;
    if (rounds.open == 0) rounds.next(at);  // or else it is another executor's, in a callback
  }
  /// std::nullopt: the timestamp is unknown.
  std::optional<Time> start(const tracing::Job& job, const tracing::Callback& callback,
                            const ThreadKey& thread) {
    Rounds& rounds = rounds_[thread];
    if (!rounds.waits && rounds.open == 0 && job.start - rounds.finish > tracing::kIdleThread)
      rounds.next(rounds.finish);
    if (rounds.last_job == Time{}) rounds.last_job = job.start;
    ++rounds.open;
    const bool service = callback.kind == tracing::CallbackKind::service;
    if (job.has_sample && !service) return job.sample.published;
    if (!service && callback.kind != tracing::CallbackKind::timer) return std::nullopt;
    if (job.timestamp > Time{} && job.timestamp <= job.start) return job.timestamp;  // hotpath's executors
    return service ? std::nullopt : of_timer(job, callback, thread);
  }
  void end(const tracing::Job& job, const ThreadKey& thread) {
    Rounds& rounds = rounds_[thread];
    if (rounds.open > 0) --rounds.open;
    rounds.finish = std::max(rounds.finish, job.finish);
  }
  void forget(const ThreadKey& ended) { rounds_.erase(ended); }

 private:
  /// What a thread did since its last two waits for work, or, if it writes no events of waits, since its
  /// last two pauses between jobs. Time{}: unknown.
  struct Rounds {
    bool waits = false;
    std::uint32_t open = 0;                             ///< Jobs that have not ended.
    Time earlier{}, earlier_job{}, last{}, last_job{};  ///< Begin and first job of each.
    Time finish{};                                      ///< Of the latest job.
    void next(Time begin) { *this = {waits, open, last, last_job, begin, {}, finish}; }
  };
  static Timer timer_from(Time first, Duration period) {
    Task task;
    task.period = period;
    return {0, task, first};
  }
  std::optional<Time> of_timer(const tracing::Job& job, const tracing::Callback& callback,
                               const ThreadKey& thread) {
    const Duration period = callback.period;
    auto& [created, timer] = timers_[job.ref.callback];
    if (!timer || created != callback.created) {
      created = callback.created;
      Time first = created + period;
      if (attached_ && created < *attached_ && first < job.start)
        first += (job.start - first) / period * period;
      timer = timer_from(first, period);
    }
    const Time next = timer->next_call();
    const std::optional<bool> late = job.start - next <= period ? true : is_late(thread, next, period);
    // A job that starts earlier than the event allows shows that the timer was reset.
    if (late != true || next - job.start > tracing::kCreationEvent) timer = timer_from(job.start, period);
    const Time timestamp = timer->call(std::max(timer->next_call(), job.start)).timestamp;
    return late ? std::optional(timestamp) : std::nullopt;
  }
  /// Whether a timer was due at `due` although its job starts more than a period later, and not reset
  /// since then; std::nullopt: unknown. A wait returns at once if a timer is due, whose job then starts
  /// before the next wait: after two waits it was not due. Where several threads wait, its callback group may
  /// be blocked meanwhile.
  [[nodiscard]] std::optional<bool> is_late(const ThreadKey& thread, Time due, Duration period) const {
    const Rounds& rounds = rounds_.at(thread);
    const bool at_once = rounds.last_job - rounds.last <= period / 2;
    const bool ran_earlier = rounds.earlier_job > Time{} && rounds.earlier_job <= due;
    if (due >= rounds.last ? rounds.last_job <= due : due >= rounds.earlier && ran_earlier && at_once)
      return true;
    const auto waits = [&](const auto& other) {
      return other.first.first == thread.first && other.second.waits;
    };
    const bool alone = rounds.waits && std::ranges::count_if(rounds_, waits) == 1;
    return due < rounds.earlier && alone ? std::optional(false) : std::nullopt;
  }

  const std::optional<Time> attached_;
  /// By callback, a timer: its creation, and its nominal instants.
  std::map<std::uint32_t, std::pair<Time, std::optional<Timer>>> timers_;
  std::map<ThreadKey, Rounds> rounds_;
};

}  // namespace hotpath::watch
