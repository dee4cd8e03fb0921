// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/graph_busy_window.hpp"

namespace hotpath {

/// Samples that come to a processor from elsewhere, as the jobs of a timer: at most one per period, but each
/// may be late.
struct SampleStream {
  TaskId publisher = kNoTask;  ///< One of those that publish together.
  TaskId root = kNoTask;       ///< The timer whose period it has.
  /// One input of each join on the way: each output of the join has taken another sample of this input.
  std::vector<TaskId> inputs = {};

  /// Whether each sample comes from a job of `root`, so that its time counts from that job's timestamp.
  [[nodiscard]] bool of_root() const { return inputs.empty(); }
};

/// The tasks of one processor as a graph with timers for the samples from elsewhere, and its busy windows.
class ProcessorWindows {
 public:
  using Elsewhere = std::function<bool(TaskId publisher, TaskId fed)>;

  /// `whole`: the whole system, in which each job of the inputs of a join that is left out may publish.
  /// `elsewhere(publisher, fed)`: whether samples come to `fed`, which is here, as a stream. `order` has the
  /// ranks of the tasks that are here.
  ProcessorWindows(const CallbackGraph& whole, const std::vector<bool>& here, const Elsewhere& elsewhere,
                   GraphOrder order, const GraphOverheads& overheads, std::vector<SampleStream> streams);
  ProcessorWindows(const ProcessorWindows&) = delete;
  ProcessorWindows& operator=(const ProcessorWindows&) = delete;

  [[nodiscard]] const std::vector<SampleStream>& streams() const { return streams_; }
  /// The timer of a stream in windows().
  [[nodiscard]] TaskId timer(std::size_t stream) const { return first_ + static_cast<TaskId>(stream); }
  /// Replaces the windows by those in which the streams are late by up to this, in ns, and timers by `late`.
  void set_jitter(const std::vector<std::int64_t>& jitter, std::int64_t late);
  [[nodiscard]] const GraphBusyWindow& windows() const { return *windows_; }
  /// Whether jobs of `from`, a timer of windows(), lead to jobs of `to` on this processor.
  [[nodiscard]] bool leads_to(TaskId from, TaskId to) const;

 private:
  const TaskId first_;
  const std::vector<SampleStream> streams_;
  CallbackGraph graph_;
  std::optional<GraphTopology> topology_;
  GraphOrder order_;
  const GraphOverheads overheads_;
  std::optional<GraphBusyWindow> windows_;
};

}  // namespace hotpath
