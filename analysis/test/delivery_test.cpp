// SPDX-License-Identifier: Apache-2.0
// Bounds that hold if each sample takes a time of its own from its publication to its arrival.
#include <gmock/gmock.h>

#include "hotpath/analysis/graph_bounds.hpp"

namespace hotpath::delivery_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::Ge;
using ::testing::Le;
using ::testing::Optional;
using namespace std::chrono_literals;

/// A slow timer, a fast one, and a chain behind the fast one.
class Delivery : public testing::Test {
 protected:
  static Task task(TaskKind kind, Duration period, Duration wcet, std::vector<TaskId> feeds) {
    Task task;
    task.kind = kind;
    task.period = task.deadline = period;
    task.wcet = task.bcet = wcet;
    task.feeds = std::move(feeds);
    return task;
  }

  Delivery() {
    graph_.set.tasks = {task(TaskKind::timer, 100ms, 30ms, {}), task(TaskKind::timer, 50ms, 5ms, {2}),
                        task(TaskKind::subscription, {}, 5ms, {})};
    graph_.chains = {{"chain", {1}, {2}}};
  }

  /// The bounds of the only method that applies.
  GraphBounds bounds(const char* executor, Duration delivery) {
    graph_.reads.resize(graph_.set.size());
    graph_.every.assign(graph_.set.size(), 1);
    Platform platform;
    platform.raised_releaser = true;
    platform.delivery_delay = delivery;
    for (GraphBounds& bounds : graph_bounds({graph_, *find_executor(executor), {}, platform})) {
      if (!bounds.refusal) return std::move(bounds);
    }
    ADD_FAILURE() << "no method covers " << executor;
    return {};
  }

  CallbackGraph graph_;
};

TEST_F(Delivery, ALessUrgentJobMayStartWhileTheSampleIsOnItsWay) {
  const ChainAge at_once = bounds("rm-ro", 0us).chains.at(0).value(),
                 later = bounds("rm-ro", 1us).chains.at(0).value();
  EXPECT_THAT(at_once.hot_path, Optional((5ms / 1ns)));
  // The slow timer's job starts before the sample arrives.
  EXPECT_THAT(later.hot_path, Optional(AllOf(Ge(35'001'000), Le(36'000'000))));
  EXPECT_EQ(later.latency, 40'001'000);  // it does so once in 100 ms
}

TEST_F(Delivery, InAnyOrderTheThreadIdlesOncePerPublication) {
  EXPECT_THAT(bounds("events-ro", 1us).tasks,
              ElementsAre(Optional(40'001'000), Optional(35'000'000), Optional(35'001'000)));
  EXPECT_EQ(bounds("events-ro", 1us).chains.at(0).value().latency, 40'001'000);
}

TEST_F(Delivery, OneLessUrgentJobMayStartBeforeEachHop) {
  graph_.set.tasks = {task(TaskKind::timer, 200ms, 5ms, {1}), task(TaskKind::subscription, {}, 5ms, {2}),
                      task(TaskKind::subscription, {}, 5ms, {})};
  graph_.chains = {{"chain", {0}, {2}}};
  for (int i = 0; i < 5; ++i) graph_.set.tasks.push_back(task(TaskKind::timer, 1s, 12ms, {}));
  // Each hop lets one of five run, and the first one a job of the sink for an older sample.
  EXPECT_THAT(
      bounds("rm-ro", 1us).chains.at(0).value().hot_path,
      Optional(5'000'000 + (1'000 + 12'000'000 + 5'000'000 + 5'000'000) + (1'000 + 12'000'000 + 5'000'000)));
}

}  // namespace hotpath::delivery_test
