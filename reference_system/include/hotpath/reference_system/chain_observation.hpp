// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Sources of one chain that an observation can hold.
inline constexpr std::size_t kMaxSources = 8;

/// What the sink of a chain found in the data that one of its jobs worked on. Fixed size: the job path stores
/// it.
struct ChainObservation {
  std::uint32_t chain = 0;
  JobRef sink;
  Time sink_start{};
  Time latest_source_start{};
  std::uint32_t dropped = 0;       ///< Sum of the dropped samples of the chain's nodes in the message.
  std::uint32_t sources_seen = 0;  ///< Bit i: source i of the chain is in the message.
  bool names_jobs = false;         ///< What `source_sequence` holds of each source seen ...
  std::array<std::uint64_t, kMaxSources> source_sequence{};  ///< ... its job's, or its publications before.
};

/// A chain of a graph by tasks.
struct ChainIndex {
  std::vector<std::vector<TaskId>> nodes;  ///< The tasks of each node that it visits.
  std::vector<TaskId> sources;             ///< Tasks in which its data begins.
  std::uint32_t sink = 0;                  ///< Index into the graph's nodes.
  std::vector<TaskId> sink_tasks;          ///< Of which one ends the chain.

  [[nodiscard]] bool ends_in(TaskId id) const {
    return std::find(sink_tasks.begin(), sink_tasks.end(), id) != sink_tasks.end();
  }
};
std::vector<ChainIndex> index_chains(const Graph& graph, const GraphTasks& tasks);

/// The tasks of the node of this name, or the task of this name; none: there is neither.
std::vector<TaskId> tasks_named(const Graph& graph, const GraphTasks& tasks, const std::string& name);

/// Joins what sinks observe with the records of the jobs at both ends of their chains.
class ChainJoin {
 public:
  ChainJoin(const Graph& graph, const GraphTasks& tasks);

  /// Jobs of one timer come in the order in which they started, as `ran`, or `running` at the end of the run.
  void add(const JobRecord& record);

  /// Where an observation counts publications, a source's n-th is that of the n-th job of its timer that ran;
  /// the end-to-end latency is unknown (-1) where that job, or the sink's own, is not among the records
  /// added.
  [[nodiscard]] ChainRecord join(const ChainObservation& observation) const;

  /// Timestamp of a sink's job that ran; nothing when it is not among the records added.
  [[nodiscard]] std::optional<Time> sink_timestamp(JobRef job) const;

 private:
  struct SinkJob {
    Time timestamp{}, finish{};
  };
  /// Jobs of one source's timer, in order.
  struct SourceJobs {
    std::vector<std::uint64_t> sequences;
    std::vector<Time> timestamps;
  };
  std::optional<Time> source_timestamp(TaskId timer, bool names_job, std::uint64_t sequence) const;

  const std::vector<ChainIndex> chains_;
  std::vector<bool> is_source_, is_sink_;  // by task
  std::vector<SourceJobs> source_jobs_;
  std::map<std::pair<TaskId, std::uint64_t>, SinkJob> sink_jobs_;
};

/// Chain records of a trace, whose `jobs` must be complete.
std::vector<ChainRecord> join_chains(const Graph& graph, const GraphTasks& tasks, const Trace& trace,
                                     const std::vector<ChainObservation>& observations);

}  // namespace hotpath
