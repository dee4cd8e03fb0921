// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hotpath/reference_system/graph.hpp"
#include "results/stored_run.hpp"

namespace hotpath::telemetry {

/// A row of chains.csv with the start and finish of its sink job.
struct ReplayedChain {
  ChainRecord record;
  Time sink_start{}, sink_finish{};  ///< Finish: kNever if the run ended first.
};

/// One repetition of a stored run, its records in the order in which they became known. The epoch
/// is time 0.
struct ReplayedTrace {
  GraphTasks tasks;  ///< With the phases of the repetition.
  Time end{};
  std::vector<JobRecord> jobs;        ///< Jobs that ran, by finish, and overwritten samples, by publication.
  std::vector<ReplayedChain> chains;  ///< By finish of the sink's job.
  std::vector<std::vector<Time>> published;  ///< By task: publication times of its samples, in order.
};

/// When a record became known.
inline Time known_at(const JobRecord& r) { return r.outcome == Outcome::ran ? r.finish : r.job.timestamp; }

/// Reads a repetition of `run`, whose jobs are loaded, and its chains.csv. Throws UsageError.
ReplayedTrace replayed_trace(const results::StoredRun& run, const Graph& graph, const std::string& executor,
                             std::uint32_t repetition);

}  // namespace hotpath::telemetry
