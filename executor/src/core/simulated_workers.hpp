// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "hotpath/core/platform.hpp"
#include "hotpath/core/scheduler.hpp"

namespace hotpath {

/// The operating system of a simulation: which workers occupy the cores, and until when.
class SimulatedWorkers {
 public:
  enum class Step : std::uint8_t {
    asleep,
    blocked,   ///< Waits for the scheduler's lock.
    turn,      ///< About to take a turn, in no time.
    release,   ///< Pays for the releases of its turn and holds the lock.
    dispatch,  ///< Pays for the start of the job that it decided for.
    run,       ///< Runs that job.
  };

  struct State {
    Step step = Step::asleep;
    bool woken = false;    ///< Somebody woke it since its last turn.
    bool in_pass = false;  ///< It has released timers since it last slept or ran a job.
    bool on_core = false;
    bool raised = false;   ///< Its OS priority is the higher of the two.
    Time until = kNever;   ///< On a core: end of the step. Asleep: when it competes for a core again.
    Duration remaining{};  ///< Off the cores: what is left of the step.
    Time step_end{};       ///< End of the step if the worker were never displaced.
    Time slice_end{};      ///< On a core.
    Duration slice_left{};
    Time start{};  ///< Start of the job of `turn`.
    Turn turn;
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

}  // namespace hotpath
