// SPDX-License-Identifier: Apache-2.0
// A deliberately simple simulation of one processor without overhead. It shares no code with
// schedulers or analyses.
#pragma once

#include <tuple>

#include "task_sets.hpp"

namespace hotpath {

enum class Rule : std::uint8_t { fixed_priority, edf, fifo };

struct SimulatedJob {
  std::size_t task = 0;
  std::int64_t nominal = 0;   ///< Nominal release.
  std::int64_t ready = 0;     ///< When the job can start.
  std::int64_t deadline = 0;  ///< Absolute.
  std::int64_t execution = 0;
  std::uint64_t tie = 0;
  std::int64_t start = -1, finish = -1;
};

/// Runs all jobs: whenever the processor is free, the first ready job by `rule` runs to completion.
inline void simulate(std::vector<SimulatedJob>& jobs, Rule rule) {
  const auto key = [&](const SimulatedJob& j) {
    const auto task = static_cast<std::int64_t>(j.task);
    switch (rule) {
      case Rule::fixed_priority:
        return std::tuple(task, j.nominal, std::uint64_t{0});
      case Rule::edf:
        return std::tuple(j.deadline, task, std::uint64_t{0});
      case Rule::fifo:
        break;
    }
    return std::tuple(j.ready, std::int64_t{0}, j.tie);
  };
  std::int64_t now = 0;
  for (;;) {
    SimulatedJob* next = nullptr;
    std::int64_t wake = std::numeric_limits<std::int64_t>::max();
    for (SimulatedJob& j : jobs) {
      if (j.start >= 0) continue;
      wake = std::min(wake, j.ready);
      if (j.ready <= now && (!next || key(j) < key(*next))) next = &j;
    }
    if (!next) {
      if (wake == std::numeric_limits<std::int64_t>::max()) return;
      now = wake;
      continue;
    }
    next->start = now;
    now += next->execution;
    next->finish = now;
  }
}

/// Jobs of periodic tasks with releases before `horizon`; execution times and release jitter are
/// random and often extreme.
inline std::vector<SimulatedJob> draw_jobs(const PeriodicTasks& tasks, std::int64_t horizon,
                                           RandomStream& random) {
  const auto draw = [&](std::int64_t low, std::int64_t high) {
    const std::uint64_t how = random.below(4);
    if (how == 0) return low;
    if (how < 3) return high;
    return low + static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(high - low + 1)));
  };
  std::vector<SimulatedJob> jobs;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    for (std::int64_t r = tasks[i].phase; r < horizon; r += tasks[i].period) {
      jobs.push_back({.task = i,
                      .nominal = r,
                      .ready = r + draw(0, tasks[i].jitter),
                      .deadline = r + tasks[i].deadline,
                      .execution = draw(tasks[i].bcet, tasks[i].wcet),
                      .tie = random.below(1000)});
    }
  }
  return jobs;
}

inline std::vector<std::int64_t> largest_response_times(const std::vector<SimulatedJob>& jobs,
                                                        std::size_t tasks) {
  std::vector<std::int64_t> largest(tasks, 0);
  for (const SimulatedJob& j : jobs) largest[j.task] = std::max(largest[j.task], j.finish - j.nominal);
  return largest;
}

/// Jobs by task, in order of their releases, read at their start and write at their finish. An event right
/// after a read is processed by the next job of the first task, and from there by the first job of each task
/// that starts at or after the previous finish. Returns the largest time until the last finish, of events
/// behind jobs with nominal releases from `from` on.
template <class Tasks>
std::int64_t largest_reaction(const std::vector<std::vector<SimulatedJob>>& jobs, const Tasks& chain,
                              std::int64_t from = 0) {
  std::int64_t largest = 0;
  const auto& first = jobs[chain.front()];
  for (std::size_t j = 0; j + 1 < first.size(); ++j) {
    if (first[j].nominal < from) continue;
    std::int64_t finish = first[j + 1].finish;
    bool arrived = true;
    for (std::size_t i = 1; i < chain.size() && arrived; ++i) {
      const auto& list = jobs[chain[i]];
      const auto reader =
          std::find_if(list.begin(), list.end(), [&](const SimulatedJob& r) { return r.start >= finish; });
      arrived = reader != list.end();
      if (arrived) finish = reader->finish;
    }
    if (arrived) largest = std::max(largest, finish - first[j].start);
  }
  return largest;
}

}  // namespace hotpath
