// SPDX-License-Identifier: Apache-2.0
#include "microbench/executor_run.hpp"

#include <cerrno>
#include <ctime>
#include <thread>

#include "hotpath/live/clock.hpp"
#include "microbench/counters.hpp"

namespace hotpath::gbench {

using namespace std::chrono_literals;

void sleep_until(Time instant) {
  const timespec t{to_ns(instant) / 1'000'000'000, to_ns(instant) % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

LiveRun::LiveRun(const TaskSet& set, std::unique_ptr<Scheduler> scheduler, JobHandler& handler,
                 const ExecutorOptions& options, std::uint64_t records_per_worker) {
  const std::size_t logs = scheduler->workers().size() + 1;
  const std::size_t bytes = (RecordLog<JobRecord>::bytes(records_per_worker) + 63) / 64 * 64;
  memory_.reset(std::aligned_alloc(64, bytes * logs));
  for (std::size_t i = 0; i < logs; ++i) {
    logs_.push_back(
        RecordLog<JobRecord>::create(static_cast<char*>(memory_.get()) + i * bytes, records_per_worker));
  }
  executor_ = std::make_unique<Executor>(set, std::move(scheduler), handler, logs_, options);
}

Duration LiveRun::run(Duration length) {
  const Time epoch = now() + 20ms;
  warm_ = epoch + length / 10;
  executor_->start(epoch, epoch + length);
  std::this_thread::sleep_until(epoch);
  const Duration before = process_cpu_time();
  executor_->join();
  return process_cpu_time() - before;
}

std::vector<double> LiveRun::of_jobs(const std::function<double(const JobRecord&)>& value) const {
  std::vector<double> values;
  for (const auto& log : logs_) {
    for (const JobRecord& r : log.contents()) {
      if (r.outcome == Outcome::ran && r.start >= warm_) values.push_back(value(r));
    }
  }
  return values;
}

std::uint64_t LiveRun::jobs_run() const {
  std::uint64_t jobs = 0;
  for (const auto& log : logs_) {
    for (const JobRecord& r : log.contents()) jobs += r.outcome == Outcome::ran ? 1 : 0;
    jobs += log.lost();
  }
  return jobs;
}

TaskSet staggered_timers(std::uint32_t n, Duration period) {
  TaskSet set;
  for (std::uint32_t i = 0; i < n; ++i) {
    Task t;
    t.name = "timer" + std::to_string(i);
    t.period = t.deadline = period;
    t.phase = period * i / n;
    set.tasks.push_back(std::move(t));
  }
  return set;
}

TaskSet subscriptions(std::uint32_t n, std::uint32_t depth) {
  TaskSet set;
  set.groups.assign(n, CallbackGroup::mutually_exclusive);
  for (std::uint32_t i = 0; i < n; ++i) {
    Task t;
    t.name = "subscription" + std::to_string(i);
    t.kind = TaskKind::subscription;
    t.group = i;
    t.depth = depth;
    set.tasks.push_back(std::move(t));
  }
  return set;
}

ExecutorOptions with_timer_policy(const std::string& policy) {
  ExecutorOptions options;
  options.timer_thread = {parse_thread_policy(policy), true};
  return options;
}

}  // namespace hotpath::gbench
