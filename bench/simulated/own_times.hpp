// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <tuple>
#include <vector>

#include "hotpath/core/workload.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "results/stored_run.hpp"
#include "setup/stored_system.hpp"

namespace hotpath::simulated {

/// How errors name the run of `--execution-times replay:RUN`.
inline constexpr const char* kReplayOption = "--execution-times replay:";
/// The columns of the file in `--execution-times listed:FILE`: a row for each job, of which those that wait
/// for a set take no time. The last three columns (the other members of GivenJob) may be left out.
inline constexpr std::array kListedColumns{"task",      "sequence",   "execution_time_ns", "release_delay_ns",
                                           "end_round", "delivery_ns"};

/// The execution times in such a file, each at most the worst case of its task. Every job that starts must
/// be listed, once: of() throws InputError for others. Throws InputError.
[[nodiscard]] std::unique_ptr<ExecutionTimes> listed_times(const std::string& file, const TaskSet& set);

/// Visits the starts and ends of the jobs that ran, by their places, in the order of time. Of those at an
/// instant, jobs that started before end first.
void for_each_change(const Trace& trace, const auto& visit) {
  enum Kind : std::uint8_t { ends, begins, ends_at_once };
  std::vector<std::tuple<Time, Kind, std::size_t>> changes;
  for (std::size_t i = 0; i < trace.jobs.size(); ++i) {
    const JobRecord& r = trace.jobs[i];
    if (r.outcome != Outcome::ran) continue;
    changes.emplace_back(r.start, begins, i);
    changes.emplace_back(r.finish, r.finish > r.start ? ends : ends_at_once, i);
  }
  std::ranges::sort(changes);
  for (const auto& [at, kind, job] : changes) visit(job, at, kind == begins);
}

/// Returns the measured trace with finish - start replaced by the time that each job had a core,
/// for replaying jobs of fixed work. This is the measured CPU time. Where that is missing, it is
/// estimated: while more jobs are running than there are cores, jobs of the raised timer management
/// thread (`raised`, if it runs jobs) have a core each, and the others share the remaining cores.
[[nodiscard]] Trace with_own_times(Trace trace, unsigned cores, std::optional<Worker> raised);

/// Overheads of the threads of a live run; zero without evidence.
struct OwnCosts {
  Duration dispatch{};  ///< Mean time from the end of a job to the start of the next one that was due.
  /// Median time from a job's timestamp to its start on a thread that slept, without `dispatch`.
  Duration wake_up{};
};
/// On one core the costs are those of all threads together, otherwise of each thread. The trace's
/// jobs must be in the order of their starts.
[[nodiscard]] OwnCosts own_costs(const Trace& trace, unsigned cores);

/// The execution times that `run`, which must be loaded, measured under one executor in one
/// repetition. Throws UsageError if that repetition is missing, or if it ran a deployment without
/// CPU times of its jobs.
[[nodiscard]] std::unique_ptr<ExecutionTimes> replayed_times(const results::StoredRun& run,
                                                             const GraphTasks& tasks,
                                                             const std::string& executor,
                                                             std::uint32_t repetition);

/// The execution times for repeating a repetition of `run`, which must be loaded, on its `system`.
/// A simulation gets its own times and releases again, unless it replayed a run that no longer exists;
/// all others as replayed_times().
[[nodiscard]] std::unique_ptr<ExecutionTimes> times_again(const results::StoredRun& run,
                                                          const setup::StoredSystem& system,
                                                          const GraphTasks& tasks,
                                                          const std::string& executor,
                                                          std::uint32_t repetition);

/// The execution times of `--execution-times replay:RUN`: those of a simulation again with its
/// releases, others as replayed_times() with releases drawn by `seed`. `run` must be loaded.
[[nodiscard]] std::unique_ptr<ExecutionTimes> times_of_run(const results::StoredRun& run,
                                                           const GraphTasks& tasks,
                                                           const std::string& executor,
                                                           std::uint32_t repetition, std::uint64_t seed);

}  // namespace hotpath::simulated
