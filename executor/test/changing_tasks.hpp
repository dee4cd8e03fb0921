// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <sstream>
#include <utility>

#include "hotpath/core/registry.hpp"
#include "task_sets.hpp"

namespace hotpath::test {

/// Drives a scheduler only by its wake-ups, like a live executor, while tasks join and leave at
/// random. Tracks the fate of every timestamp and sample.
class ChangingTasks {
 public:
  ChangingTasks(const ExecutorEntry& entry, std::uint64_t seed) : random_(seed) {
    set_ = random_graph(random_, static_cast<int>(uniform(random_, 1, 4)),
                        static_cast<int>(uniform(random_, 0, 5)), 1);
    SchedulerOptions options;
    options.workers = static_cast<unsigned>(uniform(random_, 1, 3));
    options.release_only_workers = options.workers;
    scheduler_ = entry.make(set_, options);
    workers_.resize(scheduler_->workers().size());
    accounts_.resize(set_.size());
    for (TaskId id = 0; id < set_.size(); ++id) accounts_[id].first = now_ + set_[id].phase;
    scheduler_->begin(now_);
  }

  /// Returns the first problem of the schedule; empty if there is none.
  std::string run(int steps) {
    for (int i = 0; i < steps && wrong_.empty(); ++i) step();
    // Without arrivals, so that only the new timer can wake a worker.
    for (int i = 0; i < 5 && wrong_.empty(); ++i) {
      drain();
      add();
      now_ += uniform(random_, 1, 8000) * 1us;
    }
    drain();
    scheduler_->unfinished(now_, [this](const Job& job, Outcome) { fail("was never started", job); });
    for (TaskId id = 0; id < set_.size() && wrong_.empty(); ++id) check(id);
    return wrong_;
  }
  [[nodiscard]] std::size_t jobs() const { return jobs_; }

 private:
  struct WorkerState {
    bool woken = true;
    Time wake_at = kNever;
    std::optional<Job> job;
  };
  struct Account {
    Time first{};
    std::optional<Time> removed;
    std::uint64_t samples = 0;
    std::set<std::uint64_t> seen;  ///< Sequences that ran, were skipped, overwritten or dropped.
  };

  void fail(const std::string& problem, const Job& job) {
    std::ostringstream out;
    out << "job " << job.sequence << " of task " << job.task << " " << problem << " at " << to_ns(now_);
    if (wrong_.empty()) wrong_ = out.str();
  }

  void settle(const Job& job) {
    Account& account = accounts_[job.task];
    for (std::uint64_t s = job.sequence; s <= job.sequence + job.skipped; ++s) {
      if (!account.seen.insert(s).second) fail("comes twice", job);
    }
  }

  void wake(WorkerSet woken) {
    while (!woken.empty()) workers_[woken.pop_first()].woken = true;
  }

  [[nodiscard]] bool may_turn(const WorkerState& w) const { return !w.job && (w.woken || w.wake_at <= now_); }

  void turn(Worker number) {
    WorkerState& worker = workers_[number];
    worker.woken = false;
    const Turn turn = take_turn(*scheduler_, number, now_);
    worker.wake_at = turn.decision.wake_at;
    wake(turn.decision.wake);
    if (!turn.decision.job) return;
    worker.job = turn.decision.job;
    const Job& job = *worker.job;
    if (accounts_[job.task].removed) fail("starts after the task was removed", job);
    if (set_.groups[set_[job.task].group] == CallbackGroup::mutually_exclusive) {
      for (const WorkerState& other : workers_) {
        const bool same =
            &other != &worker && other.job && set_[other.job->task].group == set_[job.task].group;
        // A release-and-execute executor with its two threads ignores groups.
        if (same && scheduler_->workers()[number] == WorkerRole::executor &&
            scheduler_->workers()[static_cast<Worker>(&other - workers_.data())] == WorkerRole::executor) {
          fail("starts while its group is busy", job);
        }
      }
    }
    if (!job.empty) settle(job);
    ++jobs_;
  }

  void finish(Worker number) {
    const Job job = *std::exchange(workers_[number].job, std::nullopt);
    workers_[number].woken = true;
    wake(scheduler_->finished(number, job, now_).wake);
  }

  void publish() {
    const auto id = static_cast<TaskId>(uniform(random_, 0, set_.size() - 1));
    if (set_[id].kind != TaskKind::subscription || accounts_[id].removed) return;
    ++accounts_[id].samples;
    const Arrival arrival = scheduler_->sample_arrived(id, {now_, now_ + 10ms, {}}, now_);
    if (arrival.overwritten) settle(*arrival.overwritten);
    wake(arrival.wake);
  }

  void add() {
    TaskSet one = random_graph(random_, 1, 1, 1);
    JoiningTask joining;
    joining.task = one.tasks[static_cast<std::size_t>(uniform(random_, 0, 1))];
    joining.task.feeds.clear();
    joining.task.group =
        static_cast<std::uint32_t>(uniform(random_, 0, static_cast<std::int64_t>(set_.groups.size())));
    joining.new_group =
        uniform(random_, 0, 1) == 0 ? CallbackGroup::reentrant : CallbackGroup::mutually_exclusive;
    if (joining.task.kind == TaskKind::subscription)
      joining.fed_by = {static_cast<TaskId>(uniform(random_, 0, set_.size() - 1))};
    const Joined joined = scheduler_->add_task(joining, now_);
    if (joined.task != join(set_, joining)) wrong_ = "another id than the next one";
    accounts_.emplace_back().first = now_ + joining.task.phase;
    wake(joined.wake);
  }

  void remove() {
    const auto id = static_cast<TaskId>(uniform(random_, 0, set_.size() - 1));
    if (accounts_[id].removed) return;
    accounts_[id].removed = now_;
    scheduler_->remove_task(id, now_, [&](const Job& job, Outcome outcome) {
      if (job.task != id || outcome != Outcome::queued) fail("is dropped with another task", job);
      settle(job);
    });
    leave(set_, id);
    if (scheduler_->unread(id) != 0) wrong_ = "a removed task has unread samples";
  }

  void step() {
    const auto number =
        static_cast<Worker>(uniform(random_, 0, static_cast<std::int64_t>(workers_.size()) - 1));
    switch (uniform(random_, 0, 11)) {
      case 0:
        now_ += uniform(random_, 1, 8000) * 1us;
        break;
      case 1:
        add();
        break;
      case 2:
        remove();
        break;
      case 3:
      case 4:
      case 5:
        publish();
        break;
      default:
        if (workers_[number].job) {
          finish(number);
        } else if (may_turn(workers_[number])) {
          turn(number);
        }
    }
  }

  /// Runs until no worker has work at this instant.
  void drain() {
    for (bool moved = true; moved && wrong_.empty();) {
      moved = false;
      for (Worker w = 0; w < workers_.size(); ++w) {
        moved |= workers_[w].job || may_turn(workers_[w]);
        if (workers_[w].job) finish(w);
        if (may_turn(workers_[w])) turn(w);
      }
    }
  }

  /// Checks that every timestamp and every sample occurred, and nothing else.
  void check(TaskId id) {
    const Account& account = accounts_[id];
    std::uint64_t expected = account.samples;
    if (set_[id].kind == TaskKind::timer) {
      const Time last = account.removed.value_or(now_);
      expected =
          last < account.first ? 0 : 1 + static_cast<std::uint64_t>((last - account.first) / set_[id].period);
    }
    const std::uint64_t seen = account.seen.size();
    if (seen == expected && (seen == 0 || *account.seen.rbegin() == seen - 1)) return;
    wrong_ = "task " + std::to_string(id) + " has " + std::to_string(seen) + " of " +
             std::to_string(expected) + " jobs";
  }

  Random random_;
  TaskSet set_;
  std::unique_ptr<Scheduler> scheduler_;
  std::vector<WorkerState> workers_;
  std::vector<Account> accounts_;  // by task
  Time now_{};
  std::size_t jobs_ = 0;
  std::string wrong_;
};

}  // namespace hotpath::test
