// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <functional>
#include <string>
#include <vector>

#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "program/latency_histogram.hpp"
#include "results/run_record.hpp"

namespace hotpath::telemetry {

/// Describes one repetition and its graph: nodes with a layout, connections and chains; for a replay, the
/// caller changes origin and speed. The `run_id` is unique per repetition, also among concurrent runs.
[[nodiscard]] telemetry::RunInfo make_run_info(const Graph& graph, const results::RunRecord& run,
                                               const std::string& executor, std::uint32_t repetition,
                                               std::int64_t epoch_ns);

/// Unix time, in nanoseconds, of the time point `from_now` after now.
[[nodiscard]] std::int64_t unix_ns(Duration from_now);

/// Running statistics of one repetition, live or replayed, from its records in the order in which
/// they become known. Memory does not grow with the length of the run.
class RunStatistics {
 public:
  /// `tasks` with the phases of the repetition. `info`: names the run, and gives the Unix time of `epoch`,
  /// its time 0. Response times of jobs with a timestamp in the warm-up do not count.
  RunStatistics(const Graph& graph, const GraphTasks& tasks, const telemetry::RunInfo& info, Time epoch,
                Duration warm_up);

  /// Adds a finished job or an overwritten sample; ignores other outcomes.
  void add(const JobRecord& record);

  /// Adds an output of a chain, whose sink job started at `sink_start`, and returns it as a
  /// numbered sample.
  telemetry::ChainSample add(const ChainRecord& record, Time sink_start);

  /// The statistics at `now`, which must not decrease; begins a new window. `published`: the number of
  /// samples published for a subscription so far. A sample is published before it is recorded.
  telemetry::Statistics take(Time now, const std::function<std::uint64_t(TaskId)>& published);

  /// Begins a window at `now`; earlier records belong to no window.
  void begin_window(Time now);

 private:
  struct NodeState {
    telemetry::NodeStatistics counts;
    program::LatencyHistogram responses;
    std::uint64_t accounted = 0;  ///< Timestamps and samples with a known outcome.
    Duration window_busy{}, window_responses{};
    std::int64_t window_jobs = 0;
  };
  struct ChainState {
    std::uint64_t dropped = 0;
    program::LatencyHistogram latencies;
  };

  /// In ns. The offset to Unix time is fixed once per run, which keeps the intervals of the steady clock.
  std::int64_t unix_time(Time t) const { return epoch_ns_ + (t - epoch_).count(); }

  const GraphTasks tasks_;
  const std::string run_id_;
  const Time epoch_;
  const std::int64_t epoch_ns_;  // since the Unix epoch
  const Time counted_from_;
  std::vector<NodeState> nodes_;
  std::vector<ChainState> chains_;
  Time window_start_;
  std::uint64_t taken_ = 0;
};

}  // namespace hotpath::telemetry
