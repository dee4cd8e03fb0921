// SPDX-License-Identifier: Apache-2.0
// Bounds on services that call each other.
#include "service_paths.hpp"

#include <gtest/gtest.h>

namespace hotpath::service_paths_test {

constexpr TaskId kLayers = 40;
constexpr std::int64_t kWait = 10;
constexpr std::int64_t kTimerEnd = 100;

/// Knows when timers finish, and nothing of services. Counts the questions.
class TimersOnly final : public PathBounds {
 public:
  std::optional<std::int64_t> until_start(TaskId, TaskId) const override { return std::nullopt; }
  std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const override {
    if (++questions_ > kMost) throw AnalysisError("too many questions");
    return root == to ? std::optional(kTimerEnd) : std::nullopt;
  }
  std::optional<std::int64_t> start_to_start(TaskId, TaskId) const override { return std::nullopt; }
  std::optional<std::int64_t> start_to_finish(TaskId, TaskId) const override { return std::nullopt; }
  std::int64_t lateness() const override { return 0; }
  PathParts parts(TaskId, TaskId) const override { return {}; }
  std::optional<std::int64_t> response(TaskId) const override { return std::nullopt; }

 private:
  /// Per layer: two services and a few rounds of the search for the delay.
  static constexpr std::uint64_t kMost = std::uint64_t{100} * kLayers;
  mutable std::uint64_t questions_ = 0;
};

/// A timer and layers of two services, each of which calls both services of the next layer: 2^40 paths.
CallbackGraph diamonds() {
  CallbackGraph graph;
  graph.set.tasks.resize(1 + 2 * kLayers);
  Task& timer = graph.set.tasks[0];
  timer.period = timer.deadline = Duration(std::int64_t{1} << 60);
  timer.feeds = {1, 2};
  for (TaskId id = 0; id < graph.set.size(); ++id) {
    Task& task = graph.set.tasks[id];
    task.wcet = task.bcet = Duration(1);
    if (id == 0) continue;
    task.kind = TaskKind::subscription;
    task.service = true;
    const TaskId next = (id - 1) / 2 * 2 + 3;
    if (next < graph.set.size()) task.feeds = {next, next + 1};
  }
  graph.reads.resize(graph.set.size());
  graph.every.assign(graph.set.size(), 1);
  return graph;
}

TEST(ServicePaths, EachServiceOfManyPathsIsVisitedOnce) {
  const CallbackGraph graph = diamonds();
  const GraphTopology topology(graph);
  const TimersOnly timers;
  const auto paths = service_paths(topology, timers, {}, kWait);
  // Each layer adds one delay and one job, on whatever path.
  std::int64_t before = kTimerEnd, layer = 0;
  for (TaskId id = 1; id < graph.set.size(); id += 2) {
    const auto a = paths->until_finish(0, id), b = paths->until_finish(0, id + 1);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(*a, *b);
    if (id > 1) {
      EXPECT_EQ(*a - before, layer);
    }
    layer = *a - before;
    EXPECT_EQ(paths->response(id), layer);
    before = *a;
  }
  EXPECT_GT(layer, kWait);
}

}  // namespace hotpath::service_paths_test
