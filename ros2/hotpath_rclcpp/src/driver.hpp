// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <exception>
#include <limits>
#include <memory>
#include <thread>
#include <vector>

#include "hotpath/live/clock.hpp"
#include "hotpath/live/parker.hpp"
#include "hotpath/live/pi_mutex.hpp"
#include "notices.hpp"
#include "schedule.hpp"

namespace hotpath {

/// Drives one scheduler with real threads, the real clock and rclcpp entities; the third driver
/// beside hotpath::Executor and the simulator. Callbacks from the middleware, timers and guard
/// conditions only enqueue. They hold the driver's lock, which is never held during a call into
/// rclcpp, and keep the driver alive.
class ExecutorDriver : public std::enable_shared_from_this<ExecutorDriver> {
 public:
  explicit ExecutorDriver(Setup setup);

  /// Marks the entities as changed: the spinning threads refresh them. Callable from any thread.
  void note_change();
  /// Wakes all sleeping threads, which check whether to continue. Callable from any thread.
  void wake_all();
  void shut_down();
  /// Call before spinning; `valid`: whether the context is valid.
  void begin(bool valid) { shut_down_.store(!valid); }

  /// Updates the entities; spin() calls it first when they have changed.
  using Refresh = std::function<void()>;

  /// Works with all threads until `spinning` becomes false or the context shuts down. Rethrows a
  /// callback's exception.
  void spin(std::atomic_bool& spinning, const Refresh& refresh);
  static constexpr std::size_t kAllJobs = std::numeric_limits<std::size_t>::max();
  /// Runs at most `jobs` callbacks in this thread, until `until`; waits for the first at most until
  /// `wait_until`. Returns the number of callbacks that ran.
  std::size_t run_some(std::atomic_bool& spinning, const Refresh& refresh, std::size_t jobs, Time until,
                       Time wait_until);
  /// Does all upkeep and returns the number of ready callbacks.
  [[nodiscard]] std::size_t queued(const Refresh& refresh);

  void join(const std::shared_ptr<Entry>& entry);
  /// Removes the entity from the schedule without changing the entity itself. Returns one element
  /// for each ready event that did not start: for waitables the id of their entity, for others 0.
  std::vector<int> leave(const std::shared_ptr<Entry>& entry);

  // Called by the entities' callbacks.
  void arrived(const std::shared_ptr<Entry>& entry, std::size_t count, int which);
  void timer_reset(const std::shared_ptr<Entry>& entry);
  /// Runs in the clock's callback, under the clock's lock. It must not release the last reference
  /// to a timer: the timer's destructor takes that lock.
  void time_jumped(const std::shared_ptr<Entry>& entry, bool clock_changed);

  void set_priority(const std::shared_ptr<void>& entity, std::int64_t priority, bool service = false);
  [[nodiscard]] std::vector<std::string> order();
  /// Logs warnings about the options.
  void check_options();
  [[nodiscard]] std::vector<std::string> thread_policies();
  [[nodiscard]] const Setup& setup() const { return schedule_.setup(); }

  static std::optional<RunningCallback> running_callback();

 private:
  struct Lane {
    Parker parker;
    bool parked = false;
    std::thread thread;
    std::optional<ThreadPolicy> policy;  ///< The obtained policy.
  };
  using Lock = std::unique_lock<PiMutex>;

  bool goes_on(const std::atomic_bool& spinning) const { return spinning.load() && !shut_down_.load(); }
  void prepare(Worker worker);
  static void log(const Notices::Lines& lines);
  void work(Worker worker, std::atomic_bool& spinning, const Refresh& refresh);
  [[nodiscard]] Worker timer_worker() const { return static_cast<Worker>(lanes_.size() - 1); }
  /// In place of a timer thread: releases the timers that were due until `now`, each at its instant.
  void release_until(Time now);
  /// Releases the timers that are due, as a timer thread does at its start or when a timer joins.
  void release_now(Time now);
  bool keeps_up(Worker worker) { return schedule_.scheduler().workers()[worker] == WorkerRole::executor; }
  /// Upkeep. Any executor worker does it, since the others may run callbacks that wait for it.
  /// Returns whether it released the lock.
  bool look_after(Lock& lock, Time now, const Refresh& refresh);
  /// Wakes `claimed`, then runs the decided job without the lock. The lock is held again on return,
  /// also after an exception, and `now` is later than all instants at which others held it.
  bool run_job(Lock& lock, Worker worker, const Job& job, WorkerSet claimed, Time& now);
  /// What a job needs of its entry's guarded part, read when it starts.
  struct Started {
    Job job;
    TimerClock clock = TimerClock::steady;
    Duration period{};         ///< Timers: the known period, 0 if they are always due.
    std::optional<int> which;  ///< Waitables: the id of the ready entity; none: no event is left.
  };
  static Started start(Entry& entry, const Job& job);
  bool execute(const std::shared_ptr<Entry>& entry, const Started& started);
  bool run_callback(const std::shared_ptr<Entry>& entry, const Started& started);
  WorkerSet enqueue(const std::shared_ptr<Entry>& entry, const SampleInfo& info, Time now);
  bool execute_timer(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer, const Started& started);
  static bool execute_waitable(const Entry& entry, rclcpp::Waitable& waitable, int which);
  /// Wakes `claimed` without the lock before it sleeps.
  void sleep(Lock& lock, Worker worker, Time until, WorkerSet claimed);

  /// `first`: the first release, if it is known better than rcl's next call.
  void schedule_timer(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer,
                      std::optional<Time> first = std::nullopt);
  void retire_timer(const std::shared_ptr<Entry>& entry);
  void after_timer(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer, TimerClock clock,
                   Duration known_period);
  bool was_moved(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer);
  void poll_cancelled();
  void release_jumped();
  /// Releases a timer of simulated time if it is due.
  void release_simulated(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer);

  void unpark(Lock& lock, WorkerSet claimed);
  WorkerSet claim(WorkerSet wake);
  /// Calls `claims` with the lock held, and then wakes the workers that it returns.
  void wake_claimed(const auto& claims) {
    WorkerSet claimed;
    {
      const std::lock_guard lock(mutex_);
      claimed = claims();
    }
    unpark(claimed);
  }
  void unpark(WorkerSet claimed);
  WorkerSet everybody() const;

  PiMutex mutex_;
  Schedule schedule_;
  std::vector<Lane> lanes_;
  std::size_t running_ = 0;  ///< Number of running jobs.
  bool alone_ = false;       ///< One thread does the work of all workers, and sleeps as worker 0.
  /// Release-only with one thread and without a policy for a timer thread: spin() has no timer thread.
  /// While a callback runs, nothing depends on a release; the thread makes up for it afterwards.
  bool without_timer_thread_ = false;
  bool releases_ = false;       ///< The thread in spin() also releases timers.
  Time next_release_ = kNever;  ///< While `releases_`: when the next timer is due, or earlier.
  std::exception_ptr error_;
  std::vector<std::weak_ptr<Entry>> cancelled_;  ///< Only if rclcpp does not report timer resets.
  std::vector<std::weak_ptr<Entry>> jumped_;     ///< Timers whose simulated time moved.
  Time poll_at_ = kNever;
  Notices notices_;
  Duration longest_period_{};
  std::atomic_bool changed_{false}, shut_down_{false};
};

}  // namespace hotpath
