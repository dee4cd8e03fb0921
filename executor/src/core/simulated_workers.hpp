// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <vector>

#include "hotpath/core/platform.hpp"
#include "hotpath/core/scheduler.hpp"
#include "hotpath/core/trace.hpp"

namespace hotpath {

/// A tournament tree: holds a time for each number below a limit, initially kNever, and finds the
/// earliest. A change costs at most O(log limit).
class EarliestTime {
 public:
  /// Forgets all times.
  void resize(std::size_t limit) {
    leaves_ = std::bit_ceil(std::max<std::size_t>(limit, 1));
    tree_.assign(2 * leaves_, kNever);
  }

  void set(std::size_t number, Time time) {
    std::size_t at = leaves_ + number;
    tree_[at] = time;
    for (at /= 2; at > 0; at /= 2) {
      const Time earlier = std::min(tree_[2 * at], tree_[2 * at + 1]);
      if (tree_[at] == earlier) break;
      tree_[at] = earlier;
    }
  }

  [[nodiscard]] Time time() const { return tree_[1]; }

  /// The smallest number with this time.
  [[nodiscard]] std::size_t number() const {
    std::size_t at = 1;
    while (at < leaves_) at = 2 * at + (tree_[2 * at] == tree_[at] ? 0 : 1);
    return at - leaves_;
  }

 private:
  std::size_t leaves_ = 1;
  std::vector<Time> tree_ = {kNever, kNever};  // nodes 2 i and 2 i + 1 are the children of node i
};

/// The simulated operating system: decides which workers, across all executors, occupy the cores,
/// and until when. Everything is inline, because this is half of the simulator's inner loop.
class SimulatedWorkers {
 public:
  enum class Step : std::uint8_t {
    asleep,
    blocked,   ///< Waiting for its scheduler's lock.
    turn,      ///< About to take a turn, which takes no time.
    release,   ///< Holds the lock while paying for its turn's releases or wait.
    dispatch,  ///< Paying the dispatch cost of the chosen job.
    run,       ///< Running the job.
  };

  struct State {
    Step step = Step::asleep;
    bool woken = false;    ///< Woken since its last turn.
    bool queues = false;   ///< Asleep: it queues for a mutex instead of waiting for an event.
    bool in_pass = false;  ///< Has released timers since it last slept or ran a job.
    bool on_core = false;
    int priority = 0;      ///< Current priority: its own, or inherited from a worker that waits for its lock.
    Time until = kNever;   ///< On a core: end of the step. Asleep: when it will compete for a core.
    Duration remaining{};  ///< Off the cores: remaining length of the step.
    Time step_end{};       ///< End of the step if the worker were never displaced.
    Time slice_end{};      ///< On a core.
    Duration slice_left{};
    Duration slice{};  ///< Length of a time slice; ordinary policy.
    SimulatedThread thread;
    std::uint32_t executor = 0;  ///< Index of the worker's executor.
    Worker number = 0;           ///< Number within that executor.
    unsigned core = 0;           ///< Last core used, if workers differ in their allowed cores.
    // The worker's last decision.
    bool has_job = false;
    std::uint32_t rounds = 0;  ///< What is left of Workload::end_round() of the job.
    JobRecord record;          ///< Of the job; its finish and outcome are those of the worker's last job.
    Time wake_at{};            ///< Without a job.
    WorkerSet to_wake;         ///< Other workers of its executor, to wake after the lock is released.

    bool ends_in_next_round() {
      if (rounds > 0) --rounds;
      return rounds == 0;
    }
  };

  explicit SimulatedWorkers(const Platform& platform)
      : cores_(std::min(platform.cores, 64U)),
        slice_(platform.time_slice),
        wake_up_latency_(platform.wake_up_latency),
        wall_clock_work_(platform.wall_clock_work) {}

  /// Adds worker `number` of `executor`.
  void add(std::uint32_t executor, Worker number, const SimulatedThread& thread) {
    State& s = states_.emplace_back();
    s.executor = executor;
    s.number = number;
    s.record.worker = static_cast<std::uint16_t>(states_.size() - 1);
    s.thread = thread;
    s.priority = thread.priority;
    // Linux's weights: one nice level is a factor of 1.25.
    s.slice = thread.nice == 0
                  ? slice_
                  : std::max(Duration(1),
                             std::chrono::duration_cast<Duration>(slice_ * std::pow(1.25, -thread.nice)));
    const std::uint64_t all = cores_ >= 64 ? ~std::uint64_t{0} : bit(static_cast<unsigned>(cores_)) - 1;
    s.thread.processors &= all;
    cores_differ_ |= s.thread.processors != all;
    sleepers_.resize(states_.size());
    ready_.reserve(states_.size());
    running_.reserve(states_.size());
    owner_.assign(cores_, kNobody);
  }

  Worker size() const { return static_cast<Worker>(states_.size()); }
  State& operator[](Worker w) { return states_[w]; }
  const State& operator[](Worker w) const { return states_[w]; }

  /// The workers on cores, by priority, then by time since they became ready.
  std::span<const Worker> on_cores() const {
    return std::span(cores_differ_ ? running_ : ready_).first(on_core_);
  }

  /// Starts the next step of a ready worker.
  void begin_step(Worker w, Step step, Duration length, Time now) {
    State& s = states_[w];
    s.step = step;
    s.until = s.step_end = now + length;
    s.remaining = length;
  }

  /// Makes the worker compete for a core to take a turn, behind the workers of equal priority.
  void make_ready(Worker w, Time now) {
    State& s = states_[w];
    if (s.step == Step::asleep) sleepers_.set(w, kNever);
    s.step = Step::turn;
    s.remaining = Duration{};
    s.slice_left = s.slice;
    assign_cores(insert(w), now);
  }

  /// A ready worker gives up its core.
  void leave(Worker w, Time now) {
    states_[w].on_core = false;
    erase(w);
    assign_cores(0, now);
  }

  /// The worker sleeps until `wake_at` or until it is woken.
  void sleep(Worker w, Time wake_at, Time now) {
    states_[w].step = Step::asleep;
    sleep_until(w, wake_at == kNever ? kNever : wake_at + wake_up_latency_);
    leave(w, now);
  }

  void wake(Worker w, Time now) {
    states_[w].woken = true;
    if (states_[w].step == Step::asleep) wake_sleeper(w, now);
  }

  /// Changes when a sleeping worker wakes.
  void sleep_until(Worker w, Time until) {
    states_[w].until = until;
    sleepers_.set(w, until);
  }

  /// Makes sleeping workers ready whose wake-up time has come.
  void wake_sleepers(Time now) {
    while (sleepers_.time() <= now) make_ready(static_cast<Worker>(sleepers_.number()), now);
  }

  /// Changes the priority of a ready worker.
  void change_priority(Worker w, int priority, Time now) {
    if (states_[w].priority == priority) return;
    // As in Linux, a worker whose priority falls does not give up the core to workers of that
    // priority.
    const bool falls = priority < states_[w].priority;
    states_[w].priority = priority;
    erase(w);
    assign_cores(insert(w, falls), now);
  }

  /// When the first of the sleeping workers wakes.
  Time next_to_wake() const { return sleepers_.time(); }

  /// The earliest of: a step ends, a sleeper wakes, a time slice ends for which other workers wait.
  Time next_instant(Time now) const {
    Time next = sleepers_.time();
    for (const Worker w : on_cores()) next = std::min(next, states_[w].until);
    if (ready_.size() > on_core_) {
      for (const Worker w : on_cores()) {
        if (others_wait_for_core_of(w)) next = std::min(next, std::max(now, states_[w].slice_end));
      }
    }
    return next;
  }

  /// Replaces workers of the ordinary policy whose time slice is over by waiting ones.
  void rotate_expired(Time now) {
    for (std::size_t i = 0; ready_.size() > on_core_ && i < on_core_;) {
      const Worker w = on_cores()[i];
      if (states_[w].slice_end > now || !others_wait_for_core_of(w)) {
        ++i;
        continue;
      }
      erase(w);
      assign_cores(insert(w), now);
      states_[w].slice_left = states_[w].slice;
    }
  }

 private:
  /// Not inline: most wakes find no sleeper, and their check stays short.
  void wake_sleeper(Worker w, Time now);

  /// Whether a worker of the ordinary policy waits for the core of `w`, also of that policy.
  bool others_wait_for_core_of(Worker w) const {
    const State& s = states_[w];
    if (s.priority != 0 || ready_.size() == on_core_) return false;
    if (!cores_differ_) return states_[ready_[cores_]].priority == 0;
    return std::any_of(ready_.begin(), ready_.end(), [&](Worker other) {
      const State& o = states_[other];
      return !o.on_core && o.priority == 0 && (o.thread.processors & bit(s.core)) != 0;
    });
  }

  /// Updates the cores after position `changed` in ready_ received another worker or was removed.
  void assign_cores(std::size_t changed, Time now) {
    if (!cores_differ_) {
      on_core_ = std::min(ready_.size(), cores_);
      // At most one other worker has moved to the last position with a core, or to the first without.
      for (const std::size_t position : {changed, cores_ - 1, cores_}) assign_core(position, now);
      return;
    }
    // A worker that changes cores continues without a pause.
    for (const Worker w : running_) {
      if (states_[w].on_core) take_core(w, now);  // otherwise it has left
    }
    choose_running();
    on_core_ = running_.size();
    for (const Worker w : running_) give_core(w, now);
  }

  void assign_core(std::size_t position, Time now) {
    if (position >= ready_.size()) return;
    const bool gets_core = position < cores_;
    if (states_[ready_[position]].on_core == gets_core) return;
    gets_core ? give_core(ready_[position], now) : take_core(ready_[position], now);
  }

  void choose_running() {
    running_.clear();
    std::fill(owner_.begin(), owner_.end(), kNobody);
    for (const Worker w : ready_) {
      tried_ = 0;
      if (running_.size() < cores_ && place(w)) running_.push_back(w);
    }
  }

  bool place(Worker w) {
    State& s = states_[w];
    const auto take = [&](unsigned core) {
      owner_[core] = w;
      s.core = core;
      return true;
    };
    const std::uint64_t allowed = s.thread.processors;
    if ((allowed & bit(s.core)) != 0 && owner_[s.core] == kNobody) return take(s.core);
    for (std::uint64_t left = allowed; left != 0; left &= left - 1) {
      const auto core = static_cast<unsigned>(std::countr_zero(left));
      if (owner_[core] == kNobody) return take(core);
    }
    // A worker of the same or a higher priority that was placed before may be able to move to another
    // core.
    for (std::uint64_t left = allowed & ~tried_; left != 0; left &= left - 1) {
      const auto core = static_cast<unsigned>(std::countr_zero(left));
      if ((tried_ & bit(core)) != 0) continue;
      tried_ |= bit(core);
      const Worker moved = owner_[core];
      if (place(moved)) return take(core);
    }
    return false;
  }

  void give_core(Worker w, Time now) {
    State& s = states_[w];
    s.on_core = true;
    s.until = wall_clock_work_ && s.step == Step::run ? std::max(now, s.step_end) : now + s.remaining;
    s.slice_end = now + s.slice_left;
  }

  void take_core(Worker w, Time now) {
    State& s = states_[w];
    s.on_core = false;
    s.remaining = s.until - now;
    s.slice_left = std::max(Duration{}, s.slice_end - now);
  }

  /// Inserts behind or in front of the workers of equal priority; returns the position.
  std::size_t insert(Worker w, bool in_front = false) {
    const int priority = states_[w].priority + (in_front ? 1 : 0);
    const auto place = std::find_if(ready_.begin(), ready_.end(),
                                    [&](Worker other) { return states_[other].priority < priority; });
    const auto inserted = ready_.insert(place, w);  // before begin(), since it may move all elements
    return static_cast<std::size_t>(inserted - ready_.begin());
  }

  void erase(Worker w) { ready_.erase(std::find(ready_.begin(), ready_.end(), w)); }
  static std::uint64_t bit(unsigned core) { return std::uint64_t{1} << core; }

  static constexpr Worker kNobody = ~Worker{0};

  const std::size_t cores_;
  const Duration slice_, wake_up_latency_;
  const bool wall_clock_work_;
  bool cores_differ_ = false;  // whether some worker may not run on all cores
  std::vector<State> states_;
  EarliestTime sleepers_;        // wake-up times of sleeping workers
  std::vector<Worker> ready_;    // by priority, then by arrival
  std::vector<Worker> running_;  // if cores differ: the workers of ready_ on a core, in the same order
  std::size_t on_core_ = 0;      // number of workers on cores
  std::vector<Worker> owner_;    // by core, if cores differ
  std::uint64_t tried_ = 0;      // cores that place() has tried
};

}  // namespace hotpath
