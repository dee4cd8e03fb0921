// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <stdexcept>
#include <vector>

#include "hotpath/core/platform.hpp"
#include "hotpath/core/workload.hpp"

namespace hotpath {

/// A system that is not explored, or whose states exceed the limit; the message says why.
struct ExplorationRefused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What one instant of an exploration stands for: all schedules that reach it by the same decisions.
class ExploredInstant {
 public:
  virtual ~ExploredInstant() = default;
  /// The instant, in the schedule in which it comes last.
  [[nodiscard]] virtual Time latest() const = 0;
  /// From the start of `earlier` to that of `later`, in the schedule in which this takes longest. Both are
  /// jobs of ExplorationOptions::tracked; `later` ends at this instant, and a message in the system has data
  /// of `earlier`.
  [[nodiscard]] virtual Duration longest_between(JobRef earlier, JobRef later) const = 0;
};

class ExplorationObserver {
 public:
  virtual ~ExplorationObserver() = default;
  /// What became of a job, as JobSink::ended() is told. Of the instants in `record`, only the timestamp of a
  /// timer's job is that of all schedules.
  virtual void ended(const JobRecord& record, const ExploredInstant& instant) = 0;
  /// The workload's finish() of the job that ended last is done.
  virtual void published(const ExploredInstant& instant) = 0;
};

struct ExplorationOptions {
  Platform platform;
  std::vector<bool> tracked;  ///< By task: its jobs' starts matter to longest_between(). Empty: none does.
  std::size_t max_states = 100'000;
};

/// Meets every schedule of `set` for the phases that it has and any execution times between `bcet` and
/// `wcet`, from 0 on for ever, at least once, and no other: until no state appears that has not been met,
/// shifted by hyperperiods. What a job does, and how long it takes, is that of the simulator (see
/// simulation.hpp), which this drives: with the longest execution time, of which the shorter ones are parts.
///
/// Between two timestamps of timers the decisions of one executor thread do not depend on the time. A state
/// therefore has, in place of the end of its running job, all ends that lie between two timestamps, as a
/// Zone together with the starts of the jobs whose data it holds; each zone is split at timestamps, and
/// states that are equal but for their zones are joined where the union is a zone. (After Nasri and
/// Brandenburg 2017, "An Exact and Sustainable Analysis of Non-Preemptive Scheduling".)
///
/// `scheduler` and `workload` must have a clone(). `workload` takes the longest execution times. Returns the
/// number of states. Throws ExplorationRefused.
std::size_t explore(const TaskSet& set, const Scheduler& scheduler, const Workload& workload,
                    const ExplorationOptions& options, ExplorationObserver& observer);

}  // namespace hotpath
