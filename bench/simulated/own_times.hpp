// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "hotpath/core/workload.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "results/stored_run.hpp"
#include "setup/stored_system.hpp"

namespace hotpath {

/// Before the folder of a run in `--execution-times replay:RUN`.
inline constexpr std::string_view kReplay = "replay:";

/// A measured trace in which finish - start is the time that each job had a core, for replaying jobs of fixed
/// work: its CPU time where that was measured; else, while more jobs had begun than there are cores, those of
/// the raised timer management thread (`raised`) count as running and the others share what is left.
[[nodiscard]] Trace with_own_times(Trace trace, unsigned cores, bool raised);

/// What the threads of a live run took beside their jobs; zero where nothing tells.
struct OwnCosts {
  Duration dispatch{};  ///< On average, from the end of a job to the start of one that was due by then.
  Duration
      wake_up{};  ///< Median from the timestamp of a job for which a thread slept to its start, beyond that.
};
/// On one core of all its threads together, else of each by itself. The trace's jobs are by start.
[[nodiscard]] OwnCosts own_costs(const Trace& trace, unsigned cores);

/// Execution times that `run`, which is loaded, measured under one executor in one repetition. Throws
/// UsageError when that did not run, or is a deployment whose jobs have no CPU times.
[[nodiscard]] std::unique_ptr<ExecutionTimes> replayed_times(const StoredRun& run, const GraphTasks& tasks,
                                                             const std::string& executor,
                                                             std::uint32_t repetition);

/// Those with which a repetition of `run`, which is loaded and whose system that is, is simulated again: the
/// ones that a simulation had, if the run that it replayed is still there; else as replayed_times().
[[nodiscard]] std::unique_ptr<ExecutionTimes> times_again(const StoredRun& run, const StoredSystem& system,
                                                          const GraphTasks& tasks,
                                                          const std::string& executor,
                                                          std::uint32_t repetition);

}  // namespace hotpath
