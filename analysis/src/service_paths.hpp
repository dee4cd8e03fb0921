// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/path_bounds.hpp"

namespace hotpath {

/// Bounds on services (Task::service) that hold however much work is more urgent, beside those of other
/// paths. They wait in one queue, in the order of their publications, and the oldest runs at the latest a
/// service wait and the longest job after the one before it (docs/response_bounds.md, "Service wait").
class ServicePaths final : public PathBounds {
 public:
  /// `topology` and `others` must outlive this object. `wait` > 0. Does not cover delivery delays.
  ServicePaths(const GraphTopology& topology, const PathBounds& others, const GraphOverheads& overheads,
               std::int64_t wait);

  std::optional<std::int64_t> until_start(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> response(TaskId subscription) const override;
  std::optional<std::int64_t> start_to_start(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> start_to_finish(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> later_start_to_start(TaskId root, TaskId to, TaskId other, TaskId input,
                                                   TaskId meets) const override {
    return others_.later_start_to_start(root, to, other, input, meets);
  }
  bool overtakes(TaskId root, TaskId to) const override { return others_.overtakes(root, to); }
  std::optional<std::int64_t> precedence(TaskId first, TaskId to, TaskId root) const override {
    return others_.precedence(first, to, root);
  }
  std::int64_t lateness() const override { return others_.lateness(); }
  PathParts parts(TaskId root, TaskId to) const override { return others_.parts(root, to); }

 private:
  /// Samples for services that stem from one timer.
  struct Stream {
    std::int64_t period, jitter, samples;
  };
  /// Ends of services' jobs after timestamps of roots, each computed once: several paths may lead to a job.
  struct Finishes {
    std::int64_t delay;  ///< From a publication to the decision for the service's job.
    std::map<std::pair<TaskId, TaskId>, std::optional<std::int64_t>> of;  ///< By root and service.
  };

  [[nodiscard]] bool is_service(TaskId id) const { return topology_.set()[id].service; }
  [[nodiscard]] std::int64_t job_work(TaskId id) const;
  [[nodiscard]] std::optional<std::int64_t> with_releases(std::int64_t work) const;
  [[nodiscard]] std::optional<std::int64_t> published(TaskId root, TaskId to, Finishes& known) const;
  [[nodiscard]] std::optional<std::int64_t> finish(TaskId root, TaskId id, Finishes& known) const;
  [[nodiscard]] std::vector<std::int64_t> jobs_of(TaskId root) const;
  [[nodiscard]] std::optional<std::vector<Stream>> streams(Finishes& known) const;
  [[nodiscard]] std::optional<std::int64_t> delay_of(const std::vector<Stream>& all) const;
  [[nodiscard]] std::optional<Finishes> find_finishes() const;

  const GraphTopology& topology_;
  const PathBounds& others_;
  const GraphOverheads overheads_;
  std::int64_t step_ = 0;  ///< Longest time from one service that runs ahead to the next.
  mutable std::optional<Finishes> finishes_;
};

}  // namespace hotpath
