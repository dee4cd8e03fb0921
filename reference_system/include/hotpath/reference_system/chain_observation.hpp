// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <iterator>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// One entry of a message's history: a contributing job and its start.
struct Stat {
  TaskId task = 0;
  std::uint32_t dropped = 0;  ///< Samples that the job's inputs lost since its last publication.
  /// Sequence of the job; in upstream's message, the publisher's number of earlier publications.
  std::uint64_t sequence = 0;
  Time start{};  ///< Start of the publishing job.
};

/// Largest number of a chain's sources in an observation.
inline constexpr std::size_t kMaxSources = 8;

/// The facts about a chain in the data of one job of its sink. Fixed size, because the job path
/// stores it.
struct ChainObservation {
  std::uint32_t chain = 0;
  JobRef sink;
  Time sink_start{};
  Time latest_source_start{};
  std::uint32_t dropped = 0;       ///< Sum of the dropped samples of the chain's nodes in the message.
  std::uint32_t sources_seen = 0;  ///< Bit i: source i of the chain is in the message.
  /// Whether `source_sequence` has the sequences of the sources' jobs, or counts their earlier publications.
  bool names_jobs = false;
  std::array<std::uint64_t, kMaxSources> source_sequence{};  ///< By source, for those seen.
};

/// A chain of a graph in terms of tasks.
struct ChainIndex {
  std::vector<std::vector<TaskId>> nodes;  ///< By visited node: its tasks.
  std::vector<TaskId> sources;             ///< Tasks where the chain's data begins.
  std::uint32_t sink = 0;                  ///< Index into the graph's nodes.
  std::vector<TaskId> sink_tasks;          ///< Tasks of which any ends the chain.

  [[nodiscard]] bool ends_in(TaskId id) const { return std::ranges::count(sink_tasks, id) > 0; }
};
/// The chains of a valid graph, in its order.
std::vector<ChainIndex> index_chains(const Graph& graph, const GraphTasks& tasks);

/// The tasks of the node with this name, or the task with this name; empty if neither exists.
std::vector<TaskId> tasks_named(const Graph& graph, const GraphTasks& tasks, const std::string& name);

/// Passes to `append` what `message`, which a job processed or produced, tells of the chains `ends` that the
/// job ends, each chain at most once per job. `job` is its Activation. Nothing for a chain none of whose
/// sources is in the message.
template <class History, class Job, class Append>
void observe_chains(const History& history, const typename History::Message& message,
                    const std::vector<ChainIndex>& chains, std::span<const std::uint32_t> ends, Job& job,
                    Append&& append) {
  // The message may be the job's own, or another one that it took.
  const auto is_own = [&] {
    bool own = false;
    history.find(message, std::span(&job.ref.task, 1), [&](const Stat& s) { own = s.start == job.start; });
    return own;
  };
  for (const std::uint32_t number : ends) {
    if (std::find(job.observed.begin(), job.observed.end(), number) != job.observed.end()) continue;
    const ChainIndex& chain = chains[number];
    ChainObservation out{number, job.ref, job.start};
    out.names_jobs = History::kNamesJobs;
    for (std::size_t i = 0; i < chain.sources.size(); ++i) {
      const TaskId entry = history.entry(number, i, chain.sources[i]);
      if (!history.goes_on(message, entry, job.ref.task) && !is_own()) continue;
      history.find(message, std::span(&entry, 1), [&](const Stat& stat) {
        out.latest_source_start =
            out.sources_seen == 0 ? stat.start : std::max(out.latest_source_start, stat.start);
        out.sources_seen |= 1U << i;
        out.source_sequence[i] = stat.sequence;
      });
    }
    if (out.sources_seen == 0) continue;
    for (const std::vector<TaskId>& node : chain.nodes)
      history.find(message, node, [&](const Stat& stat) { out.dropped += stat.dropped; });
    job.observed.push_back(number);
    append(out);
  }
}

/// Joins the sinks' observations with the records of the jobs at both ends of their chains.
class ChainJoin {
 public:
  /// `most`: jobs of a task that are kept, the latest ones.
  ChainJoin(std::vector<ChainIndex> chains, TaskId tasks, std::size_t most = ~std::size_t{0});

  /// Adds a job, `ran`, or `running` at the end of the run.
  void add(const JobRecord& record) {
    if (!record.started()) return;
    add_start(record);
    add_end(record);
  }
  /// Adds a job at its start, whose outcome is unknown, and at its end.
  void add_start(const JobRecord& r) {
    if (is_source_[r.job.task]) keep(source_jobs_[r.job.task], r);
  }
  void add_end(const JobRecord& r) {
    if (is_sink_[r.job.task] && r.outcome == Outcome::ran) keep(sink_jobs_[r.job.task], r);
  }

  /// Joins one observation. If it counts publications, a source's n-th publication belongs to the
  /// n-th job of its timer that ran. The end-to-end latency is unknown (-1) if that job, or the
  /// sink's own, has not been added.
  [[nodiscard]] ChainRecord join(const ChainObservation& observation) const;

  /// Timestamp of a sink's job that ran; std::nullopt if it has not been added.
  [[nodiscard]] std::optional<Time> sink_timestamp(JobRef job) const;

 private:
  struct EndJob {
    std::uint64_t sequence = 0;
    Time timestamp{}, finish = kNever;
  };
  using Jobs = std::deque<EndJob>;  // by sequence
  void keep(Jobs& jobs, const JobRecord& r) {
    auto behind = jobs.end();
    while (behind != jobs.begin() && std::prev(behind)->sequence > r.job.sequence) --behind;
    jobs.insert(behind, {r.job.sequence, r.job.timestamp, r.finish});
    if (jobs.size() > most_) jobs.pop_front();
  }
  /// nullptr: it has not been added.
  static const EndJob* find(const Jobs& jobs, std::uint64_t sequence);

  const std::vector<ChainIndex> chains_;
  const std::size_t most_;
  std::vector<bool> is_source_, is_sink_;      // by task
  std::vector<Jobs> source_jobs_, sink_jobs_;  // by task
};

/// Chain records of a trace, whose `jobs` must be complete.
std::vector<ChainRecord> join_chains(const Graph& graph, const GraphTasks& tasks, const Trace& trace,
                                     const std::vector<ChainObservation>& observations);

/// The way of data along a chain. A source's data counts for a chain only if it reached the sink without
/// feedback edges. A feedback edge, a step of data from messages of one task to messages of another, lies
/// on a cycle of such edges and does not lead away from the sources: the number of edges from the nearest
/// source to its end is at most that to its beginning.
///
/// Where data of a source can also reach the sink through feedback, the messages' histories have an entry
/// of their own for the data that did not: a lane.
class ChainLanes {
 public:
  /// Task of the history entries of lanes: this bit, and the number of the lane.
  static constexpr TaskId kLane = TaskId{1} << 31U;
  static constexpr bool is_lane(TaskId entry) { return (entry & kLane) != 0; }

  ChainLanes() = default;
  ChainLanes(const Graph& graph, const GraphTasks& tasks);
  /// `next`: by task, the tasks whose messages have the data of its messages.
  ChainLanes(const std::vector<ChainIndex>& chains, const std::vector<std::vector<TaskId>>& next);

  [[nodiscard]] std::size_t size() const { return lanes_.size(); }
  /// The task of the history entry with the data of source `source` of chain `chain`, which is `task`:
  /// that task itself, if its data has no other way.
  [[nodiscard]] TaskId entry(std::uint32_t chain, std::size_t source, TaskId task) const;
  /// The source whose data an entry of a lane has.
  [[nodiscard]] TaskId source_of(TaskId entry) const { return lanes_[entry & ~kLane].source; }
  /// The entries of the lanes that begin with jobs of the task.
  [[nodiscard]] std::span<const TaskId> begins(TaskId task) const;
  /// Whether the lane's data goes on from a message of `from` to messages of `to`, or to a job of `to`
  /// that takes it.
  [[nodiscard]] bool keeps(TaskId entry, TaskId from, TaskId to) const;

 private:
  struct Lane {
    std::uint32_t chain = 0;
    std::size_t source_index = 0;
    TaskId source = 0;
  };
  std::vector<Lane> lanes_;
  std::vector<std::vector<TaskId>> begins_;                    // by task
  std::vector<std::vector<std::pair<TaskId, TaskId>>> edges_;  // by chain; sorted
};

}  // namespace hotpath
