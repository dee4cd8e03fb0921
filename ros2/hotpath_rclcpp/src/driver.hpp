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
#include "schedule.hpp"

namespace hotpath {

/// Drives one scheduler with real threads, the real clock and the entities of rclcpp: the third driver beside
/// hotpath::Executor and the simulator. Callbacks of middleware, timers and guard conditions only enqueue,
/// under a lock that is held during no call into rclcpp; they keep the driver alive.
class ExecutorDriver : public std::enable_shared_from_this<ExecutorDriver> {
 public:
  explicit ExecutorDriver(Setup setup) : schedule_(std::move(setup)) {
    lanes_ = std::vector<Lane>(schedule_.scheduler().workers().size());
  }

  /// Who spins looks after the entities when this is called; the mark of a change, any thread.
  void note_change();
  /// All who sleep look again whether to go on; any thread.
  void wake_all();
  void shut_down();
  /// Before spinning: whether the context is valid.
  void begin(bool valid) { shut_down_.store(!valid); }

  /// What spin() does before anything else when entities have changed.
  using Refresh = std::function<void()>;

  /// With all threads, until `spinning` becomes false or the context shuts down. Rethrows a callback's
  /// exception.
  void spin(std::atomic_bool& spinning, const Refresh& refresh);
  static constexpr std::size_t kAllJobs = std::numeric_limits<std::size_t>::max();
  /// In this thread: runs at most `jobs` callbacks until `until`; sleeps for the first until `wait_until`.
  /// Returns how many ran.
  std::size_t run_some(std::atomic_bool& spinning, const Refresh& refresh, std::size_t jobs, Time until,
                       Time wait_until);
  /// After all upkeep: how many callbacks are ready.
  [[nodiscard]] std::size_t queued(const Refresh& refresh);

  void join(const std::shared_ptr<Entry>& entry);
  /// The entity stays as it is; nothing of it starts any more. Returns what was ready and did not start, as
  /// it was announced: for waitables which of their entities, for others zeros.
  std::vector<int> leave(const std::shared_ptr<Entry>& entry);

  /// What the entities' callbacks call.
  void arrived(const std::shared_ptr<Entry>& entry, std::size_t count, int which);
  void timer_reset(const std::shared_ptr<Entry>& entry);
  /// In the clock's own callback, which holds its lock: a timer that ended here would take it again.
  void time_jumped(const std::shared_ptr<Entry>& entry, bool clock_changed);

  void set_priority(const std::shared_ptr<void>& entity, std::int64_t priority);
  [[nodiscard]] std::vector<std::string> order();
  void log_order(const char* why);
  [[nodiscard]] std::vector<std::string> thread_policies();
  [[nodiscard]] const Setup& setup() const { return schedule_.setup(); }

  static std::optional<RunningCallback> running_callback();

 private:
  struct Lane {
    Parker parker;
    bool parked = false;
    std::thread thread;
    std::optional<ThreadPolicy> policy;  ///< Obtained.
  };
  using Lock = std::unique_lock<PiMutex>;

  bool goes_on(const std::atomic_bool& spinning) const { return spinning.load() && !shut_down_.load(); }
  void prepare(Worker worker);
  void work(Worker worker, std::atomic_bool& spinning, const Refresh& refresh);
  bool keeps_up(Worker worker) { return schedule_.scheduler().workers()[worker] == WorkerRole::executor; }
  /// The upkeep that any executor worker does, since the others may be in callbacks that wait for it; returns
  /// whether it had to let the lock go.
  bool look_after(Lock& lock, Time now, const Refresh& refresh);
  /// Runs the job of a decision outside of the lock, after waking `claimed`; an exception leaves with the
  /// lock held.
  bool run_job(Lock& lock, Worker worker, const Job& job, WorkerSet claimed);
  void unpark(Lock& lock, WorkerSet claimed);
  bool execute(const std::shared_ptr<Entry>& entry, const Job& job);
  WorkerSet enqueue(const std::shared_ptr<Entry>& entry, const SampleInfo& info, Time now);
  bool execute_timer(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer);
  bool execute_waitable(const std::shared_ptr<Entry>& entry, rclcpp::Waitable& waitable);
  void sleep(Lock& lock, Worker worker, Time until);

  void schedule_timer(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer);
  void retire_timer(const std::shared_ptr<Entry>& entry);
  void after_timer(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer, TimerClock clock,
                   Duration known_period);
  bool was_moved(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer);
  void poll_cancelled();
  void release_jumped();
  /// Releases a timer of simulated time that is due.
  void release_simulated(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer);

  WorkerSet claim(WorkerSet wake);
  void unpark(WorkerSet claimed);
  WorkerSet everybody() const;

  PiMutex mutex_;
  Schedule schedule_;
  std::vector<Lane> lanes_;
  std::size_t running_ = 0;  ///< Jobs.
  bool alone_ = false;       ///< One thread does the work of all workers, and sleeps as worker 0.
  std::exception_ptr error_;
  std::vector<std::weak_ptr<Entry>> cancelled_;  ///< Only where a timer does not tell of its reset.
  std::vector<std::weak_ptr<Entry>> jumped_;     ///< Timers whose simulated time moved.
  Time poll_at_ = kNever;
  std::optional<Time> learnt_at_;  ///< The last edge that was learnt and not logged.
  Duration longest_period_{};
  std::atomic_bool changed_{false}, shut_down_{false};
};

}  // namespace hotpath
