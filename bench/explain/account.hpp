// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "explain/causes.hpp"
#include "explain/job_window.hpp"
#include "explain/system.hpp"
#include "hotpath/core/workload.hpp"

namespace hotpath::explain {

/// Divides intervals of a latency among causes. Every call accounts for all of its interval.
class Account {
 public:
  /// `times`: of every job that works, in a simulation; nullptr: not known.
  Account(const System& system, const JobWindow& window, const ExecutionTimes* times)
      : system_(system), window_(window), times_(times) {}

  /// The job `step` of the path runs in [from, to).
  void run(const JobRecord& job, std::size_t step, Time from, Time to);
  /// It waits in [from, to), before its start; until `before`, its predecessor on the path, has
  /// finished, that job runs on the path.
  void wait(const Seen& job, std::size_t step, Time from, Time to, const JobRecord* before);
  /// All of an interval.
  void add(Cause cause, std::size_t step, Duration length, JobRef behind = {}, Rule rule = Rule::none);

  [[nodiscard]] std::vector<Part> take() { return std::move(parts_); }

 private:
  struct Held {
    Time from, to;
    JobRef by;
  };
  /// A part of the time for which a thread had a job to run.
  struct Spent {
    Cause cause;  ///< `running`, `displaced` or `withheld`.
    Duration length{};
    JobRef by;  ///< Displaced: by this job; without a task: by the timer thread.
  };
  /// A job that waits.
  struct Waiting {
    const JobRecord& job;
    std::size_t step;
    const ServingExecutor& executor;
    const JobRecord* before;
    Time arrival{};            ///< When the executor could know of the job.
    Time snapshot{};           ///< Wait sets: the poll that found it, or the older sample.
    const JobRecord* older{};  ///< The first older job of its task that started after the arrival.
  };

  [[nodiscard]] std::vector<Spent> spent(const JobRecord& job, Time from, Time to) const;
  [[nodiscard]] std::vector<Held> displaced(const JobRecord& job, Time since, Time from, Time to) const;
  [[nodiscard]] bool shares_core(const JobRecord& other, const JobRecord& job) const;
  [[nodiscard]] Waiting waiting(const Seen& job, std::size_t step, const JobRecord* before) const;
  [[nodiscard]] Rule rule(const Waiting& w, const JobRecord& first) const;
  void behind(const Waiting& w, const JobRecord& other, Time from, Time to);
  void behind_on_core(const Waiting& w, const JobRecord& other, Duration length);
  void gap(const Waiting& w, Time from, Time to);
  void gap_on_core(const Waiting& w, Time from, Time to);
  void idle(const Waiting& w, Time from, Time to);

  const System& system_;
  const JobWindow& window_;
  const ExecutionTimes* const times_;
  std::vector<Part> parts_;
};

}  // namespace hotpath::explain
