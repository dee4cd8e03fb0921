// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/core/priority_order.hpp"

namespace hotpath {

/// tau_i = (C_i, T_i, D_i, phi_i) of the paper, Section II-A, with release jitter. All times are in
/// nanoseconds; the formulas hold in any single unit.
struct PeriodicTask {
  std::string name;           ///< For messages and tables; may be empty.
  TaskId id = kNoTask;        ///< Index in the TaskSet it came from.
  std::int64_t wcet = 0;      ///< C, > 0.
  std::int64_t period = 0;    ///< T, > 0; the minimum time between two releases if sporadic.
  std::int64_t deadline = 0;  ///< D, relative, > 0.
  std::int64_t bcet = 0;      ///< In [0, wcet].
  std::int64_t jitter = 0;    ///< J: latest release after the nominal one, >= 0.
  std::int64_t phase = 0;     ///< First nominal release, >= 0.
};

/// A task set in priority order, highest first. Under EDF the order only breaks ties.
using PeriodicTasks = std::vector<PeriodicTask>;

/// The meaning of instants. `continuous`: bounds are suprema; a blocking job has started an
/// arbitrarily short time before, so it blocks for (almost) its whole C (the paper). `discrete`:
/// time consists of whole units (here: nanoseconds), and a blocking job has started one unit before
/// (George 1996, Prosa); bounds are at most one unit below `continuous`.
enum class TimeModel : std::uint8_t { continuous, discrete };

/// The timers of `set` in the order of `policy`: level, then task id; under edf and fifo by task
/// id. Throws AnalysisError if the set has subscriptions, which are not periodic tasks.
PeriodicTasks periodic_tasks(const TaskSet& set, Policy policy);

/// The inputs that a method accepts; check_tasks() rejects all others.
struct MethodScope {
  std::string_view method;          ///< Name in messages, with author and year.
  std::string_view instead;         ///< Methods that accept the rejected inputs.
  bool arbitrary_deadlines = true;  ///< D > T allowed.
  bool jitter = true;               ///< J > 0 allowed.
  bool overload = true;             ///< Utilisation above 1 allowed (overloaded tasks then have no bound).
};

/// Throws AnalysisError for an empty set, times out of range, or input outside `scope`.
void check_tasks(const PeriodicTasks& tasks, const MethodScope& scope);

/// The task's name, or its position if it has none.
std::string task_label(const PeriodicTasks& tasks, std::size_t position);

}  // namespace hotpath
