// SPDX-License-Identifier: Apache-2.0
// One run of an executor in a world of controlled threads, and the invariants of the run.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "../src/live/executor_threads.hpp"
#include "controlled_threads.hpp"
#include "schedule_checks.hpp"

namespace hotpath::test {

using namespace std::chrono_literals;

/// Task sets: timer -> a, and b with samples from outside, each in its own mutually exclusive
/// callback group; or a and b share a group, and b also takes the timer's samples, so both are
/// ready at once.
inline TaskSet timer_and_two_subscriptions(bool shared_group) {
  TaskSet set;
  const TaskId timer = add_timer(set, 400ns, 0ns, 100ns);
  const TaskId a = add_subscription(set, {timer}, 0ns, 10);
  const TaskId b = add_subscription(set, {}, 0ns, 10);
  if (shared_group) {
    set.groups.pop_back();
    set.tasks[b].group = set.tasks[a].group;
    set.tasks[timer].feeds.push_back(b);
  }
  return set;
}

/// Samples are plain numbers and need not be returned.
class NoOwner final : public SampleOwner {
 public:
  void give_back(const void*, std::uintptr_t) noexcept override {}
  void lend_again(std::uintptr_t) noexcept override {}
};

/// One run of an executor in a world of controlled threads.
class ControlledRun final : public JobHandler {
 public:
  struct Plan {
    Duration length;
    int outside = 0;  ///< Number of samples from outside, one every 300 ns.
    Duration stop_at;
    bool shared_group = false;
  };

  ControlledRun(const std::string& executor, World& world, const Plan& plan)
      : set_(timer_and_two_subscriptions(plan.shared_group)), given_(set_), world_(world), plan_(plan) {
    if (world_.fault == Fault::group_ignored) given_.groups.back() = CallbackGroup::reentrant;
    auto scheduler = find_executor(executor)->make(given_, {.workers = 2});
    for (std::size_t i = 0; i <= scheduler->workers().size(); ++i) {
      memory_.emplace_back(
          new std::max_align_t[RecordLog<JobRecord>::bytes(kCapacity) / sizeof(std::max_align_t) + 1]);
      logs_.push_back(RecordLog<JobRecord>::create(memory_.back().get(), kCapacity));
    }
    executor_.emplace(set_, std::move(scheduler), *this, logs_, ExecutorOptions{});
    next_[0] = Time{} + kEpoch + set_[0].phase;
    world_.when_idle = [this] { check_nothing_waits(); };
  }

  /// The first problem; empty if there is none.
  std::string run() {
    trace_.epoch = Time{} + kEpoch;
    const Time end = trace_.epoch + plan_.length;
    executor_->start(trace_.epoch, end);
    ControlledSync::Thread outside([this] {
      for (int i = 0; i < plan_.outside; ++i) {
        world_.wait([] { return false; }, trace_.epoch + 150ns + i * 300ns);
        deliver(2, {});
      }
    });
    world_.wait([] { return false; }, trace_.epoch + plan_.stop_at);
    executor_->stop();
    stopped_ = true;
    trace_.end = executor_->join();
    ended_ = true;
    outside.join();
    executor_->close(trace_.end);
    collect();
    if (world_.defect.empty()) world_.defect = legal(set_, trace_, true);
    if (world_.defect.empty()) world_.defect = balanced(set_, trace_);
    if (world_.defect.empty()) world_.defect = groups_exclusive(set_, trace_);
    return world_.defect;
  }

  void run(const Job& job, Time, Sample, Worker) override {
    world_.step();
    if (set_[job.task].kind == TaskKind::timer) {
      next_[job.task] = job.timestamp + (1 + job.skipped) * set_[job.task].period;
    } else {
      ++started_[job.task];
    }
    for (const TaskId fed : set_[job.task].feeds) deliver(fed, job.ref());
  }

 private:
  static constexpr std::uint64_t kCapacity = 64;
  static constexpr Duration kEpoch = 1000ns;

  void deliver(TaskId task, JobRef parent) {
    static NoOwner nobody;
    ++published_[task];
    executor_->deliver(task, {world_.now(), kNever, parent}, Sample(&nobody, nobody, 0));
    ++delivered_[task];
  }

  /// All threads sleep: then no delivered sample waits, no timer is due, and the run has not been
  /// stopped.
  void check_nothing_waits() {
    const Time now = world_.now();
    if (ended_ || !world_.defect.empty()) return;
    if (stopped_) world_.defect = "a thread sleeps on though the run was stopped";
    if (now >= trace_.epoch + std::min(plan_.length, plan_.stop_at)) return;
    for (TaskId id : {1, 2}) {
      if (started_[id] < delivered_[id])
        world_.defect = "all sleep while a sample of " + set_[id].name + " waits";
    }
    if (next_[0] <= now) world_.defect = "all sleep while the timer is due";
  }

  void collect() {
    for (const auto& log : logs_)
      trace_.jobs.insert(trace_.jobs.end(), log.contents().begin(), log.contents().end());
    for (JobRecord& r : trace_.jobs) {
      if (r.outcome == Outcome::ran && r.finish > trace_.end) r.outcome = Outcome::running;
    }
    std::erase_if(trace_.jobs, [](const JobRecord& r) { return r.outcome == Outcome::empty; });
    std::ranges::stable_sort(trace_.jobs, {}, &JobRecord::start);
    trace_.published.assign(std::begin(published_), std::end(published_));
  }

  const TaskSet set_;
  TaskSet given_;  ///< The task set given to the executor.
  World& world_;
  const Plan plan_;
  std::vector<std::unique_ptr<std::max_align_t[]>> memory_;
  BasicExecutor<ControlledSync>::Logs logs_;
  std::optional<BasicExecutor<ControlledSync>> executor_;
  Trace trace_;
  Time next_[1]{};
  std::uint64_t published_[3]{}, delivered_[3]{}, started_[3]{};
  bool stopped_ = false, ended_ = false;
};

}  // namespace hotpath::test
