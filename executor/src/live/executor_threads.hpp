// SPDX-License-Identifier: Apache-2.0
// The member functions of BasicExecutor, for code that instantiates it.
#pragma once

#include <sched.h>

#include <algorithm>
#include <cassert>
#include <ctime>
#include <mutex>

#include "hotpath/live/executor.hpp"

namespace hotpath {

template <class Sync>
BasicExecutor<Sync>::BasicExecutor(const TaskSet& set, std::unique_ptr<Scheduler> scheduler,
                                   JobHandler& handler, Logs logs, const ExecutorOptions& options)
    : set_(set),
      scheduler_(std::move(scheduler)),
      handler_(handler),
      logs_(std::move(logs)),
      options_(options),
      inbox_(set),
      arrived_(set.size(), 0),
      lanes_(scheduler_->workers().size()) {
  assert(logs_.size() == lanes_.size() + 1);
  for (const WorkerRole role : scheduler_->workers()) workers_.push_back({role, {}});
}

template <class Sync>
BasicExecutor<Sync>::~BasicExecutor() {
  stop();
  join();
}

template <class Sync>
void BasicExecutor<Sync>::start(Time epoch, Time end) {
  {
    const std::lock_guard lock(mutex_);
    epoch_ = epoch;
    end_ = end;
    scheduler_->begin(epoch);
  }
  typename Sync::Latch prepared(static_cast<std::ptrdiff_t>(lanes_.size()));
  for (Worker w = 0; w < lanes_.size(); ++w) {
    lanes_[w].thread = typename Sync::Thread([this, w, &prepared] {
      prepare(w);
      prepared.count_down();
      work(w);
    });
  }
  prepared.wait();
  if (setup_error_.empty()) return;  // written only before the latch opened
  stop();
  join();
  throw ThreadSetupError(setup_error_);
}

template <class Sync>
void BasicExecutor<Sync>::prepare(Worker worker) {
  const bool timer = workers_[worker].role == WorkerRole::timer_management;
  try {
    workers_[worker].policy = Sync::prepare_thread(workers_[worker].role,
                                                   timer ? options_.timer_thread : options_.executor_threads);
  } catch (const ThreadSetupError& error) {
    const std::lock_guard lock(mutex_);
    setup_error_ = error.what();
  }
}

template <class Sync>
void BasicExecutor<Sync>::stop() {
  WorkerSet parked;
  {
    const std::lock_guard lock(mutex_);
    end_ = std::min(end_, Sync::now());  // under the lock, hence after all decisions so far
    for (Worker w = 0; w < lanes_.size(); ++w) parked.insert(w);
    parked = claim(parked);
  }
  unpark(parked);
}

template <class Sync>
Time BasicExecutor<Sync>::join() {
  for (Lane& lane : lanes_) {
    if (lane.thread.joinable()) lane.thread.join();
  }
  const std::lock_guard lock(mutex_);
  return end_;
}

template <class Sync>
void BasicExecutor<Sync>::close(Time end) {
  std::vector<Sample> unread;  // given back after the lock
  const std::lock_guard lock(mutex_);
  if (std::exchange(closed_, true)) return;
  unread = inbox_.clear();
  scheduler_->unfinished(end - Duration(1), [this](const Job& job, Outcome outcome) {
    logs_.back().append({.job = job, .outcome = outcome});
  });
}

template <class Sync>
WorkerSet BasicExecutor<Sync>::claim(WorkerSet wake) {
  WorkerSet claimed;
  while (!wake.empty()) {
    const Worker w = wake.pop_first();
    if (std::exchange(lanes_[w].parked, false)) claimed.insert(w);
  }
  return claimed;
}

template <class Sync>
void BasicExecutor<Sync>::unpark(WorkerSet claimed) {
  while (!claimed.empty()) lanes_[claimed.pop_first()].parker.unpark();
}

template <class Sync>
void BasicExecutor<Sync>::deliver(TaskId task, const SampleInfo& info, Sample sample) {
  std::optional<Sample> replaced;  // given back after the lock
  WorkerSet claimed;
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    ++arrived_[task];
    const Arrival arrival = scheduler_->sample_arrived(task, info, Sync::now());
    replaced = inbox_.push(task, std::move(sample));
    assert(inbox_.count(task) == scheduler_->unread(task));
    if (arrival.overwritten)
      logs_.back().append({.job = *arrival.overwritten, .outcome = Outcome::overwritten});
    claimed = claim(arrival.wake);
  }
  unpark(claimed);
}

template <class Sync>
std::uint64_t BasicExecutor<Sync>::arrived(TaskId task) const {
  const std::lock_guard lock(mutex_);
  return arrived_[task];
}

template <class Sync>
void BasicExecutor<Sync>::work(Worker worker) {
  Lane& lane = lanes_[worker];
  WorkerSet to_wake;  // claimed under the lock, woken outside of it
  std::unique_lock lock(mutex_);
  // The clock is read once each time the lock is taken: `now` is the end of the last job as well as the
  // instant of the next decision.
  Time now = Sync::now();
  while (now < end_) {
    const Turn turn = take_turn(*scheduler_, worker, now);
    to_wake |= claim(turn.decision.wake);
    if (turn.decision.job) {
      const Job& job = *turn.decision.job;
      Sample sample;
      if (set_[job.task].kind == TaskKind::subscription && !job.empty) {
        sample = inbox_.pop(job.task);
        assert(inbox_.count(job.task) == scheduler_->unread(job.task));
      }
      lock.unlock();
      unpark(std::exchange(to_wake, {}));
      run_job(worker, job, std::move(sample));
      lock.lock();
      now = Sync::now();
      to_wake = claim(scheduler_->finished(worker, job, now).wake);
    } else {
      const std::uint32_t ticket = lane.parker.ticket();
      const Time until = std::min(turn.decision.wake_at, end_);
      lane.parked = true;
      lock.unlock();
      unpark(std::exchange(to_wake, {}));
      if (until > now) lane.parker.park_until(ticket, until);
      lock.lock();
      lane.parked = false;
      now = Sync::now();
    }
  }
  lock.unlock();
  unpark(to_wake);
}

template <class Sync>
void BasicExecutor<Sync>::run_job(Worker worker, const Job& job, Sample sample) {
  JobRecord record{.job = job, .start = Sync::now()};
  record.worker = static_cast<std::uint16_t>(options_.first_worker + worker);
  if (job.empty) {
    record.outcome = Outcome::empty;
    record.finish = record.start;
  } else {
    const bool measures = options_.measure_cpu_time;
    const Duration cpu_before = measures ? read_clock(CLOCK_THREAD_CPUTIME_ID) : Duration{};
    handler_.run(job, record.start, std::move(sample), record.worker);
    if (measures) record.cpu_time = read_clock(CLOCK_THREAD_CPUTIME_ID) - cpu_before;
    record.finish = Sync::now();
  }
  record.cpu = static_cast<std::int16_t>(sched_getcpu());
  logs_[worker].append(record);
}

}  // namespace hotpath
