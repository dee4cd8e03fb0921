// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "processor_windows.hpp"

namespace hotpath {

/// The tasks that run on a processor, and their order there.
struct StreamedProcessor {
  std::vector<bool> here;  ///< By task.
  GraphOrder order;
  GraphOverheads overheads;  ///< GraphOverheads::delivery does not count.
};

/// Tasks whose samples may come late: from other processors, from threads that wake the reader's thread, or
/// all of them.
struct StreamedSystem {
  static constexpr std::uint32_t kNowhere = ~0U;

  CallbackGraph graph;                      ///< The inputs of each join run in one thread.
  std::vector<std::uint32_t> thread_of;     ///< By task.
  std::vector<std::uint32_t> processor_of;  ///< By task; kNowhere: several, in the ordinary scheduling class.
  std::vector<bool> bounded;                ///< By task: not of that class.
  std::map<std::uint32_t, StreamedProcessor> processors;
  /// Until a thread that sleeps continues, other than GraphOverheads::wake_up of its processor.
  std::int64_t wake_up = 0;
  std::int64_t delivery = 0;  ///< Longest time from a publication to its arrival; each sample has its own.
};

/// Bounds along paths whose samples may come late (docs/analysis.md, "Delivery"). Each hop is a busy window
/// of its own. The latest ends of the jobs that publish such samples are the least fixed point of all
/// windows.
class StreamPaths final : public PathBounds {
 public:
  /// `others`, other bounds for the same system, must outlive this object; nullptr: there are none. Throws
  /// AnalysisError if there is no fixed point.
  explicit StreamPaths(StreamedSystem system, const PathBounds* others = nullptr);

  std::optional<std::int64_t> until_start(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> start_to_start(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> start_to_finish(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> later_start_to_start(TaskId, TaskId, TaskId, TaskId, TaskId) const override {
    return std::nullopt;
  }
  bool overtakes(TaskId, TaskId) const override { return false; }
  std::optional<std::int64_t> precedence(TaskId, TaskId, TaskId) const override { return std::nullopt; }
  std::int64_t lateness() const override;
  std::optional<std::int64_t> response(TaskId subscription) const override;
  PathParts parts(TaskId root, TaskId to) const override;

 private:
  using Bound = std::optional<std::int64_t>;

  const GraphBusyWindow& windows_of(TaskId id) const;
  std::int64_t late() const;
  std::int64_t least_end(TaskId root, TaskId id) const;
  std::vector<TaskId> together(TaskId id) const;
  std::vector<SampleStream> outputs(TaskId publisher) const;
  std::vector<SampleStream> jobs(TaskId id) const;
  bool comes_as_stream(TaskId publisher, TaskId fed) const;
  std::vector<SampleStream> streams_to(const std::vector<bool>& here);
  void need(const std::vector<TaskId>& tasks);
  Bound latest_end(TaskId root, TaskId id) const;
  Bound jitter_at(TaskId root, TaskId id) const;
  Bound hop(TaskId input, TaskId publisher) const;
  Bound jitter_of(const SampleStream& stream) const;
  void set_jitters();
  bool raise_ends();
  void settle();
  template <class Way>
  void for_each_way(TaskId root, TaskId to, Way way) const;
  Bound until(TaskId root, TaskId to, TaskId timer, TaskId publisher, const SampleStream* stream,
              bool works) const;
  Bound longest(TaskId root, TaskId to, bool works) const;
  Bound along_hops(TaskId root, TaskId to) const;
  bool on_one_processor(TaskId root, TaskId to) const;

  const StreamedSystem system_;
  const PathBounds* const others_;
  const GraphTopology topology_;
  const TaskSet& set_;
  std::map<std::uint32_t, std::unique_ptr<ProcessorWindows>> processors_;
  /// By root and task, of those that publish late samples or from whose join such samples come.
  std::map<std::pair<TaskId, TaskId>, Bound> ends_;
  mutable std::map<std::tuple<TaskId, TaskId, bool>, Bound> known_;
  mutable std::map<std::pair<TaskId, TaskId>, Bound> along_hops_;
};

}  // namespace hotpath
