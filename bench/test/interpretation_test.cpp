// SPDX-License-Identifier: Apache-2.0
// The stages of an import, from events to a reproduction.
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <span>
#include <tuple>

#include "hotpath/tracing/assembler.hpp"
#include "import/stages.hpp"

namespace hotpath::interpretation_test {

using namespace std::chrono_literals;
using K = tracing::EventKind;

/// A recording from the events of process 7, whose thread t ran on processor t - 1.
class Events : public tracing::Sink {
 public:
  void ended(tracing::Job&& job) override { jobs_.push_back(std::move(job)); }
  void lost(const tracing::LostSample& sample) override { lost_.push_back(sample); }

  imports::Imported imported() const {
    imports::CtfOptions options;
    options.trace = "traces/two";
    return imports::import_system(imports::recorded_system(assembler_.system(), jobs_, lost_, 0), options);
  }

 protected:
  void tell(std::uint32_t thread, K kind, std::int64_t ns, const std::array<std::uint64_t, 4>& number,
            const std::array<const char*, 2>& text = {"", ""}) {
    const auto processor = static_cast<std::int32_t>(thread - 1);
    assembler_.event({kind, 7, thread, processor, from_ns(ns), number, text});
  }
  /// Node `source`, whose timer has a period of 10 ms.
  void tell_source(std::int64_t created) {
    tell(1, K::node_init, created, {1, 2}, {"source", "/"});
    tell(1, K::publisher_init, created + 1, {11, 1, 12}, {"/a", ""});
    tell(1, K::timer_init, created + 2, {13, 10'000'000});
    tell(1, K::timer_callback_added, created + 3, {13, 14});
    tell(1, K::timer_link_node, created + 4, {13, 1});
  }
  /// Node `sink`, which subscribes to a topic.
  void tell_sink(std::int64_t created, const char* topic) {
    tell(1, K::node_init, created, {3, 4}, {"sink", "/"});
    tell(1, K::subscription_init, created + 1, {21, 3, 22, 1}, {topic, ""});
    tell(1, K::rclcpp_subscription_init, created + 2, {21, 23});
    tell(1, K::subscription_callback_added, created + 3, {23, 24});
  }
  /// A job of `sink`.
  void tell_sample(std::uint32_t thread, std::int64_t at, std::int64_t published, std::int64_t end) {
    tell(thread, K::rmw_take, at, {22, 9, static_cast<std::uint64_t>(published), 1});
    tell(thread, K::callback_start, at, {24});
    tell(thread, K::callback_end, end, {24});
  }

  tracing::Assembler assembler_{*this};

 private:
  std::vector<tracing::Job> jobs_;
  std::vector<tracing::LostSample> lost_;
};

/// `source` publishes /a on thread 1, and `sink` takes it on thread 2. Both executors emit their
/// waits. `work`: of `sink`, by job.
class TwoThreads : public Events {
 public:
  explicit TwoThreads(const std::function<std::int64_t(std::int64_t job)>& work = [](std::int64_t) {
    return 2'950'000;
  }) {
    tell_source(0);
    tell_sink(5, "/a");
    for (std::int64_t job = 0; job < 99; ++job) {
      const std::int64_t at = 10'010'000 + 10'000'000 * job;
      const auto stamp = static_cast<std::uint64_t>(at + 2'000'000);
      tell(1, K::wait_for_work, at - 1000, {});
      tell(1, K::callback_start, at, {14});
      tell(1, K::rcl_publish, at + 2'000'000, {11, 9});
      tell(1, K::rmw_publish, at + 2'000'000, {12, 9, stamp});
      tell(1, K::callback_end, at + 2'001'000, {14});
      tell(2, K::wait_for_work, at + 2'001'000, {});
      tell_sample(2, at + 2'050'000, at + 2'000'000, at + 2'050'000 + work(job));
    }
    assembler_.finish();
  }
};

/// On one thread, a timer and a subscription to a topic of another system, whose first sample was
/// published two periods before the timer was created.
class EarlySamples : public Events {
 public:
  EarlySamples() {
    constexpr std::int64_t kMs = 1'000'000, kCreated = 20 * kMs - 2;  // of the timer: at 20 ms
    tell_sink(-kMs, "/b");
    for (std::int64_t at = 0; at < 1000 * kMs; at += 10 * kMs) {
      if (at == 20 * kMs) tell_source(kCreated);
      tell_sample(1, at + 100, at, at + kMs);
      if (at < 30 * kMs) continue;
      tell(1, K::callback_start, at + 2 * kMs, {14});
      tell(1, K::callback_end, at + 3 * kMs, {14});
    }
    assembler_.finish();
  }
};

/// Two timers of 10 ms that are due together: `slow` runs first, as its priority demands and its
/// creation does not. Only the events of `executor` say that, since `quick` has no priority. Empty: it has
/// none.
class Stated : public Events {
 public:
  explicit Stated(const char* executor) {
    constexpr std::int64_t kMs = 1'000'000;
    tell(1, K::node_init, 0, {1, 2}, {"quick", "/"});
    tell(1, K::node_init, 0, {3, 4}, {"slow", "/"});
    for (const std::uint64_t node : {1U, 3U}) {
      tell(1, K::timer_init, 1, {10 * node, 10 * kMs});
      tell(1, K::timer_callback_added, 1, {10 * node, 10 * node + 1});
      tell(1, K::timer_link_node, 1, {10 * node, node});
    }
    const bool states = *executor != '\0';
    if (states) {
      tell(1, K::executor_init, 2, {90}, {executor, "priorities.yaml"});
      tell(1, K::executor_callback, 3, {90, 0, 10}, {"timer", ""});
      tell(1, K::executor_callback, 3, {90, 1, 30}, {"timer", ""});
      tell(1, K::executor_priority, 4, {90, 0, std::numeric_limits<std::int64_t>::max()});
      for (const std::uint64_t changed : {8U, 5U}) tell(1, K::executor_priority, 4, {90, 1, changed});
    }
    for (std::int64_t at = 10 * kMs; at < 1000 * kMs; at += 10 * kMs) {
      for (const std::uint64_t task : {1U, 0U}) {
        const std::uint64_t callback = task == 0 ? 11 : 31;
        const std::int64_t start = at + 1000 + (task == 0 ? 3 * kMs : 0);
        if (states) tell(1, K::executor_job, start - 10, {90, task});
        tell(1, K::callback_start, start, {callback});
        tell(1, K::callback_end, start + 2 * kMs, {callback});
      }
    }
    assembler_.finish();
  }
};

TEST(Import, CountsOutliersOfDelivery) {
  imports::RecordedCosts costs;
  costs.deliveries.assign(199, 10us);
  costs.deliveries.push_back(101us);
  const imports::MeasuredCost delivery = imports::measured_delivery(std::span(&costs, 1));
  EXPECT_EQ(std::tuple(delivery.n, delivery.outliers, delivery.p99, delivery.greatest),
            std::tuple(200U, 1U, 10us, 101us));
}

TEST(Import, ExecutionTimesThatDependOnThePreviousOneAreReplayed) {
  const auto model = [](const std::function<std::int64_t(std::int64_t)>& work) {
    const TwoThreads two(work);
    return two.imported().best.graph.platform.execution_times;
  };
  EXPECT_EQ(model([](auto job) { return job < 50 ? 2'000'000 : 4'000'000; }), ExecutionTimeModel::replayed);
  EXPECT_EQ(model([](auto job) { return job % 2 == 0 ? 2'000'000 : 4'000'000; }),
            ExecutionTimeModel::measured);
}

TEST(Import, PhasesOfSamplesFromOutsideAreTheLeastOnesAfterTheEpoch) {
  const EarlySamples early;
  const Graph graph = early.imported().best.graph;
  ASSERT_EQ(graph.nodes.back().name, "outside");
  EXPECT_EQ(graph.nodes.back().callbacks.front().phase, Duration::zero());
}

TEST(Import, BelievesAnExecutorThatStatesItsNameAndPriorities) {
  const Stated stated("fp-ro:first");
  const imports::Imported imported = stated.imported();
  EXPECT_EQ(imported.recognitions.front().verdict, imports::Verdict::recognised);
  EXPECT_EQ(imported.recognitions.front().stated, "fp-ro:first");
  const imports::Reproduction& best = imported.best;
  EXPECT_EQ(best.labels, (std::vector<std::string>{"fp-ro:first"}));
  EXPECT_EQ(best.graph.nodes[1].callbacks.front().priority, 5);
  EXPECT_FALSE(best.graph.nodes[0].callbacks.front().priority);
  EXPECT_EQ(best.check.light, imports::Light::green);
}

TEST(Import, WithoutAKnownNameDecisionsDecide) {
  for (const char* name : {"", "llf-ro"}) {
    const Stated stated(name);
    const imports::Imported imported = stated.imported();
    EXPECT_EQ(imported.recognitions.front().stated, "");
    EXPECT_GT(imported.recognitions.front().ranking.size(), 1U);
  }
}

}  // namespace hotpath::interpretation_test
