// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <string>
#include <vector>

#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "program/latency_histogram.hpp"

namespace hotpath {

/// The run's own time as Unix time: fixed once per run, so that distances stay those of the steady clock.
struct UnixTime {
  Time epoch{};               ///< The run's time 0 ...
  std::int64_t epoch_ns = 0;  ///< ... in nanoseconds since the Unix epoch.
  std::int64_t operator()(Time t) const { return epoch_ns + (t - epoch).count(); }
};

/// Running statistics of one repetition, from its records in the order in which they become known; the same
/// for a live run and for a replay. Memory does not grow with the length of the run.
class RunStatistics {
 public:
  /// `tasks` with the phases of the repetition. Response times of jobs with a timestamp in the warm-up do not
  /// count.
  RunStatistics(const Graph& graph, const GraphTasks& tasks, std::string run_id, const UnixTime& time,
                Duration warm_up);

  /// A job, when it has finished, or a sample that was overwritten; other outcomes say nothing yet.
  void add(const JobRecord& record);

  /// An output of a chain's sink whose job started at `sink_start`, as a numbered sample.
  telemetry::ChainSample add(const ChainRecord& record, Time sink_start);

  /// Samples that were published for a subscription so far. Read after the records: a sample counts here
  /// first.
  void set_published(TaskId subscription, std::uint64_t samples) { published_[subscription] = samples; }

  /// What is known at `now`; begins a new window. `now` never goes back.
  telemetry::Statistics take(Time now);

  /// What was added before is in no window.
  void begin_window(Time now);

 private:
  struct NodeState {
    telemetry::NodeStatistics counts;
    LatencyHistogram responses;
    std::uint64_t accounted = 0;  ///< Timestamps and samples that became something.
    Duration window_busy{}, window_responses{};
    std::int64_t window_jobs = 0;
  };
  struct ChainState {
    std::uint64_t dropped = 0;
    LatencyHistogram latencies;
  };

  std::uint64_t reached(TaskId timer, Time now) const;

  const GraphTasks tasks_;
  std::vector<bool> stores_only_;  // by task
  const std::string run_id_;
  const UnixTime time_;
  const Time counted_from_;
  std::vector<std::uint64_t> published_;
  std::vector<NodeState> nodes_;
  std::vector<ChainState> chains_;
  Time window_start_;
  std::uint64_t taken_ = 0;
};

}  // namespace hotpath
