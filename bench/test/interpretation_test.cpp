// SPDX-License-Identifier: Apache-2.0
#include "import/interpretation.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <functional>

#include "hotpath/tracing/assembler.hpp"

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using K = tracing::EventKind;

/// A recording from the events of process 7, whose thread t ran on processor t - 1.
class Events : public tracing::Sink {
 public:
  void ended(tracing::Job&& job) override { recording.jobs.push_back(std::move(job)); }
  void lost(const tracing::LostSample& sample) override { recording.lost.push_back(sample); }

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

 public:
  imports::Recording recording{
      .system = assembler_.system(), .jobs = {}, .lost = {}, .deployment_file = "deployment.yaml"};
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

imports::Interpretations interpreted(Events& events) {
  imports::CtfOptions options;
  options.trace = "traces/two";
  return imports::interpret(events.recording, options);
}

TEST(Interpretation, FindsExecutorsAndTheirDeploymentWithoutFiles) {
  TwoThreads two;
  const imports::Interpretations all = interpreted(two);
  EXPECT_EQ(two.recording.graph.graph.name, "two");
  EXPECT_EQ(all.best.check.light, imports::Light::green) << all.best.check.reasons.front();
  EXPECT_EQ(all.best.labels, (std::vector<std::string>{"default", "default"}));
  ASSERT_TRUE(all.best.executor->deployment);
  const Deployment& plan = all.best.executor->deployment->plan;
  EXPECT_EQ(plan.executor_of, (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(plan.executors[0].name, "thread_1");
  EXPECT_EQ(plan.executors[1].processors, (std::vector<int>{1}));
  EXPECT_FALSE(std::filesystem::exists(plan.file));
}

TEST(Interpretation, ExecutionTimesThatDependOnThePreviousOneAreReplayed) {
  const auto model = [](const std::function<std::int64_t(std::int64_t)>& work) {
    TwoThreads two(work);
    return interpreted(two).best.graph.platform.execution_times;
  };
  EXPECT_EQ(model([](auto job) { return job < 50 ? 2'000'000 : 4'000'000; }), ExecutionTimeModel::replayed);
  EXPECT_EQ(model([](auto job) { return job % 2 == 0 ? 2'000'000 : 4'000'000; }),
            ExecutionTimeModel::measured);
}

TEST(Interpretation, InstantsOfJobsAreRelativeToTheEpoch) {
  TwoThreads two;
  std::size_t relative = 0;
  for (const JobRecord& r : interpreted(two).best.trace.jobs)
    relative += r.job.deadline == r.job.timestamp + 10ms && r.job.timestamp < Time{} + 1s;
  EXPECT_EQ(relative, 99U) << "jobs of the timer";
}

TEST(Interpretation, PhasesOfSamplesFromOutsideAreTheLeastOnesAfterTheEpoch) {
  EarlySamples early;
  const Graph graph = interpreted(early).best.graph;
  ASSERT_EQ(graph.nodes.back().name, "outside");
  EXPECT_EQ(graph.nodes.back().callbacks.front().phase, Duration::zero());
}

TEST(Interpretation, RecordedDeploymentsAreReadAsTheyWereWritten) {
  TwoThreads two;
  const imports::Interpretations all = interpreted(two);
  const Deployment& plan = all.best.executor->deployment->plan;
  std::string file = std::filesystem::temp_directory_path() / "hotpath-XXXXXX.yaml";
  ASSERT_GE(mkstemps(file.data(), 5), 0);
  std::ofstream(file) << deployment_yaml(all.best.graph, all.best.tasks, plan);
  const Deployment read = find_deployment(file, all.best.graph, all.best.tasks);
  std::filesystem::remove(file);
  EXPECT_EQ(read.executor_of, plan.executor_of);
  EXPECT_EQ(read.processes, plan.processes);
  for (std::size_t e = 0; e < plan.executors.size(); ++e) {
    EXPECT_EQ(read.executors[e].name, plan.executors[e].name);
    EXPECT_EQ(read.executors[e].executor, plan.executors[e].executor);
    EXPECT_EQ(read.executors[e].policy, plan.executors[e].policy);
    EXPECT_EQ(read.executors[e].processors, plan.executors[e].processors);
  }
}

}  // namespace
}  // namespace hotpath
