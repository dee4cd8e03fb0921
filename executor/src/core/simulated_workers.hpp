// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "hotpath/core/platform.hpp"
#include "hotpath/core/scheduler.hpp"

namespace hotpath {

/// The operating system of a simulation: which workers occupy the cores, and until when. All inline: it is
/// half of the simulator's inner loop.
class SimulatedWorkers {
 public:
  enum class Step : std::uint8_t {
    asleep,
    blocked,   ///< Waits for the scheduler's lock.
    turn,      ///< About to take a turn, in no time.
    release,   ///< Pays for the releases or for the wait of its turn and holds the lock.
    dispatch,  ///< Pays for the start of the job that it decided for.
    run,       ///< Runs that job.
  };

  struct State {
    Step step = Step::asleep;
    bool woken = false;    ///< Somebody woke it since its last turn.
    bool in_pass = false;  ///< It has released timers since it last slept or ran a job.
    bool slept = true;     ///< It has not run a job since it last slept.
    bool on_core = false;
    bool raised = false;   ///< Its OS priority is the higher of the two.
    Time until = kNever;   ///< On a core: end of the step. Asleep: when it competes for a core again.
    Duration remaining{};  ///< Off the cores: what is left of the step.
    Time step_end{};       ///< End of the step if the worker were never displaced.
    Time slice_end{};      ///< On a core.
    Duration slice_left{};
    // The worker's last decision.
    bool has_job = false;
    Job job;
    Time start{};       ///< Start of the job.
    Time wake_at{};     ///< Without a job.
    WorkerSet to_wake;  ///< Others, once the lock is free.
  };

  SimulatedWorkers(std::span<const WorkerRole> roles, const Platform& platform);

  Worker size() const { return static_cast<Worker>(states_.size()); }
  State& operator[](Worker w) { return states_[w]; }
  const State& operator[](Worker w) const { return states_[w]; }

  /// The workers on cores, by priority, then by how long they have been ready.
  std::size_t on_core() const { return std::min<std::size_t>(ready_.size(), cores_); }
  Worker running(std::size_t i) const { return ready_[i]; }

  /// The worker, which is ready, does this next.
  void begin_step(Worker w, Step step, Duration length, Time now);
  /// The worker competes for a core, to take a turn, behind those of its priority.
  void make_ready(Worker w, Time now);
  /// The worker, which is ready, gives up its core.
  void leave(Worker w, Time now);
  /// The worker leaves until `wake_at` or until it is woken.
  void sleep(Worker w, Time wake_at, Time now);
  void wake(WorkerSet set, Time now);
  /// Makes those asleep ready whose time has come.
  void wake_sleepers(Time now);
  /// Makes those ready that wait for the lock.
  void unblock(Time now);

  /// When a step ends, a sleeper wakes, or a time slice that others wait for is over, whichever comes first.
  Time next_instant(Time now) const;
  /// Lets workers whose time slice is over change places with those of equal priority that wait.
  void rotate_expired(Time now);

 private:
  bool contended() const { return ready_.size() > cores_; }
  bool shares_with_waiting(Worker w) const { return states_[w].raised == states_[ready_[cores_]].raised; }
  void assign_cores(Time now);
  void insert(Worker w);

  const std::size_t cores_;
  const Duration slice_, wake_up_latency_;
  const bool wall_clock_work_;
  std::vector<State> states_;
  std::vector<Worker> ready_;  // by priority, then by arrival; the first `cores_` have a core
};

inline SimulatedWorkers::SimulatedWorkers(std::span<const WorkerRole> roles, const Platform& platform)
    : cores_(platform.cores),
      slice_(platform.time_slice),
      wake_up_latency_(platform.wake_up_latency),
      wall_clock_work_(platform.wall_clock_work),
      states_(roles.size()) {
  ready_.reserve(roles.size());
  for (Worker w = 0; w < size(); ++w) {
    states_[w].raised = platform.raised_releaser && roles[w] == WorkerRole::timer_management;
  }
}

inline void SimulatedWorkers::insert(Worker w) {
  const auto place = std::find_if(ready_.begin(), ready_.end(),
                                  [&](Worker other) { return states_[w].raised && !states_[other].raised; });
  ready_.insert(place, w);
}

inline void SimulatedWorkers::begin_step(Worker w, Step step, Duration length, Time now) {
  State& s = states_[w];
  s.step = step;
  s.until = s.step_end = now + length;
  s.remaining = length;
}

inline void SimulatedWorkers::make_ready(Worker w, Time now) {
  State& s = states_[w];
  s.step = Step::turn;
  s.remaining = Duration{};
  s.slice_left = slice_;
  insert(w);
  assign_cores(now);
}

inline void SimulatedWorkers::leave(Worker w, Time now) {
  states_[w].on_core = false;
  ready_.erase(std::find(ready_.begin(), ready_.end(), w));
  assign_cores(now);
}

inline void SimulatedWorkers::sleep(Worker w, Time wake_at, Time now) {
  states_[w].step = Step::asleep;
  states_[w].slept = true;
  states_[w].until = wake_at == kNever ? kNever : wake_at + wake_up_latency_;
  leave(w, now);
}

inline void SimulatedWorkers::wake(WorkerSet set, Time now) {
  while (!set.empty()) {
    const Worker w = set.pop_first();
    State& s = states_[w];
    s.woken = true;
    if (s.step != Step::asleep) continue;
    s.until = std::min(s.until, now + wake_up_latency_);
    if (s.until <= now) make_ready(w, now);
  }
}

inline void SimulatedWorkers::wake_sleepers(Time now) {
  for (Worker w = 0; w < size(); ++w) {
    if (states_[w].step == Step::asleep && states_[w].until <= now) make_ready(w, now);
  }
}

inline void SimulatedWorkers::unblock(Time now) {
  for (Worker w = 0; w < size(); ++w) {
    if (states_[w].step == Step::blocked) make_ready(w, now);
  }
}

inline void SimulatedWorkers::assign_cores(Time now) {
  for (std::size_t i = 0; i < ready_.size(); ++i) {
    State& s = states_[ready_[i]];
    const bool gets_core = i < cores_;
    if (s.on_core == gets_core) continue;
    s.on_core = gets_core;
    if (gets_core) {
      s.until = wall_clock_work_ && s.step == Step::run ? std::max(now, s.step_end) : now + s.remaining;
      s.slice_end = now + s.slice_left;
    } else {
      s.remaining = s.until - now;
      s.slice_left = std::max(Duration{}, s.slice_end - now);
    }
  }
}

inline Time SimulatedWorkers::next_instant(Time now) const {
  Time next = kNever;
  for (const State& s : states_) {
    if (s.on_core || s.step == Step::asleep) next = std::min(next, s.until);
  }
  if (contended()) {
    for (std::size_t i = 0; i < cores_; ++i) {
      if (shares_with_waiting(ready_[i])) next = std::min(next, std::max(now, states_[ready_[i]].slice_end));
    }
  }
  return next;
}

inline void SimulatedWorkers::rotate_expired(Time now) {
  if (!contended()) return;
  for (std::size_t i = 0; i < cores_ && contended();) {
    const Worker w = ready_[i];
    if (states_[w].slice_end > now || !shares_with_waiting(w)) {
      ++i;
      continue;
    }
    ready_.erase(ready_.begin() + static_cast<std::ptrdiff_t>(i));
    insert(w);
    assign_cores(now);
    states_[w].slice_left = slice_;
  }
}

}  // namespace hotpath
