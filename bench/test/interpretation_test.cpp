// SPDX-License-Identifier: Apache-2.0
#include "import/interpretation.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "hotpath/tracing/assembler.hpp"

namespace hotpath {
namespace {

using K = tracing::EventKind;

/// The events of node `source` with a timer of 10 ms on thread 1, which publishes /a, and of node
/// `sink`, which takes it on thread 2 of another processor. Both executors emit their waits.
class TwoThreads : public tracing::Sink {
 public:
  TwoThreads() {
    tell(1, K::node_init, 0, {1, 2}, {"source", "/"});
    tell(1, K::publisher_init, 1, {11, 1, 12}, {"/a", ""});
    tell(1, K::timer_init, 2, {13, 10'000'000});
    tell(1, K::timer_callback_added, 3, {13, 14});
    tell(1, K::timer_link_node, 4, {13, 1});
    tell(1, K::node_init, 5, {3, 4}, {"sink", "/"});
    tell(1, K::subscription_init, 6, {21, 3, 22, 1}, {"/a", ""});
    tell(1, K::rclcpp_subscription_init, 7, {21, 23});
    tell(1, K::subscription_callback_added, 8, {23, 24});
    for (std::int64_t at = 10'010'000; at < 1'000'000'000; at += 10'000'000) {
      const auto stamp = static_cast<std::uint64_t>(at + 2'000'000);
      tell(1, K::wait_for_work, at - 1000, {});
      tell(1, K::callback_start, at, {14});
      tell(1, K::rcl_publish, at + 2'000'000, {11, 9});
      tell(1, K::rmw_publish, at + 2'000'000, {12, 9, stamp});
      tell(1, K::callback_end, at + 2'001'000, {14});
      tell(2, K::wait_for_work, at + 2'001'000, {});
      tell(2, K::rmw_take, at + 2'050'000, {22, 9, stamp, 1});
      tell(2, K::callback_start, at + 2'050'000, {24});
      tell(2, K::callback_end, at + 5'000'000, {24});
    }
    assembler_.finish();
  }

  void ended(tracing::Job&& job) override { recording.jobs.push_back(std::move(job)); }
  void lost(const tracing::LostSample& sample) override { recording.lost.push_back(sample); }

 private:
  void tell(std::uint32_t thread, K kind, std::int64_t ns, const std::array<std::uint64_t, 4>& number,
            const std::array<const char*, 2>& text = {"", ""}) {
    const auto processor = static_cast<std::int32_t>(thread - 1);
    assembler_.event({kind, 7, thread, processor, from_ns(ns), number, text});
  }

  tracing::Assembler assembler_{*this};

 public:
  imports::Recording recording{
      .system = assembler_.system(), .jobs = {}, .lost = {}, .deployment_file = "deployment.yaml"};
};

imports::Interpretations interpreted(TwoThreads& two) {
  imports::CtfOptions options;
  options.trace = "traces/two";
  return imports::interpret(two.recording, options);
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
