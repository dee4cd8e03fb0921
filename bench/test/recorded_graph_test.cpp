// SPDX-License-Identifier: Apache-2.0
// The graph of a recorded system: its callback groups, services and cycles.
#include "import/recorded_graph.hpp"

#include <gmock/gmock.h>

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using testing::Contains;
using testing::HasSubstr;
using K = tracing::CallbackKind;

struct Recorded {
  tracing::System system;
  std::vector<tracing::Job> jobs;

  tracing::Callback& callback(K kind, std::uint32_t node, std::uint32_t topic = tracing::kNone) {
    if (node == system.nodes.size()) system.nodes.push_back("/n" + std::to_string(node));
    tracing::Callback& callback = system.callbacks.emplace_back();
    callback.kind = kind;
    callback.node = node;
    callback.topic = topic;
    if (kind == K::timer) callback.period = 10ms;
    if (kind != K::timer)
      system.topics.at(topic).subscriptions.push_back(
          static_cast<std::uint32_t>(system.callbacks.size() - 1));
    return callback;
  }
  tracing::Job& job(std::uint32_t callback, std::uint32_t thread, Duration start, Duration finish) {
    tracing::Job& job = jobs.emplace_back();
    job.ref = {callback, system.callbacks.at(callback).jobs++};
    job.thread = thread;
    job.start = Time{} + start;
    job.finish = Time{} + finish;
    return job;
  }
  imports::RecordedGraph graph() const {
    return imports::make_recorded_graph(system, jobs, std::vector<std::uint32_t>(system.callbacks.size(), 0),
                                        "g");
  }
};

TEST(RecordedGraph, OnlyJobsOfTwoThreadsOverlap) {
  for (const std::uint32_t thread : {0U, 1U}) {
    Recorded r;
    r.callback(K::timer, 0);
    r.callback(K::timer, 0);
    r.job(0, 0, 0ms, 10ms);
    r.job(1, thread, 2ms, 4ms);
    EXPECT_EQ(r.graph().graph.nodes.at(0).groups.size(), thread == 0 ? 1U : 2U);
  }
}

/// Nine irregular requests are repeated one by one, ten at their mean rate, regular ones periodically.
TEST(RecordedGraph, RequestsOfServicesComeFromTimers) {
  struct Case {
    int requests;
    bool regular;
    std::size_t timers;
  };
  for (const auto& [requests, regular, timers] :
       {Case{9, false, 9}, {10, false, 1}, {3, true, 1}, {1, true, 1}}) {
    Recorded r;
    r.system.topics = {{"/service", {}}};
    r.callback(K::timer, 0);
    r.callback(K::service, 0, 0);
    r.job(0, 0, 0ms, 1ms);
    for (int i = 1; i <= requests; ++i) {
      const Duration at = i * 10ms * (regular ? 1 : i);
      tracing::Job& job = r.job(1, 0, at, at + 1ms);
      job.has_sample = true;
      job.sample.published = job.start;
    }
    const imports::RecordedGraph graph = r.graph();
    EXPECT_NE(graph.task_of.at(1), kNoTask);
    const Node& outside = graph.graph.nodes.at(1);
    EXPECT_EQ(outside.name, imports::kOutside);
    ASSERT_EQ(outside.callbacks.size(), timers) << requests;
    EXPECT_EQ(outside.callbacks.front().phase, Duration(10ms));
    if (regular && requests > 1) {
      EXPECT_EQ(outside.callbacks.front().period, Duration(10ms));
    }
  }
}

TEST(RecordedGraph, ServicesOfOtherThreadsAreLeftOut) {
  Recorded r;
  r.system.topics = {{"/service", {}}};
  r.callback(K::timer, 0);
  r.callback(K::service, 0, 0);
  r.job(0, 0, 0ms, 1ms);
  r.job(1, 1, 0ms, 1ms);
  const auto graph = imports::make_recorded_graph(r.system, r.jobs, {0, tracing::kNone}, "g");
  EXPECT_EQ(graph.task_of.at(1), kNoTask);
  EXPECT_THAT(graph.notes,
              Contains(HasSubstr("1 callbacks of services and clients with 1 jobs ran on threads")));
}

TEST(RecordedGraph, ASecondSubscriptionOfANodeReadsACopyOfTheTopic) {
  Recorded r;
  r.system.topics = {{"/a", {}}};
  r.callback(K::timer, 0);
  for (int i = 0; i < 2; ++i) r.callback(K::subscription, 1, 0);
  for (int i = 0; i < 10; ++i) {
    r.job(0, 0, i * 10ms, i * 10ms + 1ms).published.push_back({0, Time{} + i * 10ms});
    for (const std::uint32_t reader : {1U, 2U}) r.job(reader, 0, i * 10ms + 2ms, i * 10ms + 3ms);
  }
  const imports::RecordedGraph graph = r.graph();
  EXPECT_EQ(graph.tasks.set[graph.task_of.at(1)].name, "n1/a");
  EXPECT_EQ(graph.tasks.set[graph.task_of.at(2)].name, "n1/a_2");
  EXPECT_EQ(graph.tasks.set[graph.task_of.at(0)].feeds.size(), 2U);
}

/// Two nodes answer each other; the second one ran less often.
TEST(RecordedGraph, ACycleIsCutBeforeTheCallbackWithTheFewestJobs) {
  Recorded r;
  r.system.topics = {{"/a", {}}, {"/b", {}}};
  r.callback(K::subscription, 0, 0);
  r.callback(K::subscription, 1, 1);
  for (int i = 0; i < 10; ++i) {
    r.job(0, 0, i * 10ms, i * 10ms + 1ms).published.push_back({1, Time{} + i * 10ms});
    if (i % 2 == 0)
      r.job(1, 0, i * 10ms + 2ms, i * 10ms + 3ms).published.push_back({0, Time{} + i * 10ms + 2ms});
  }
  EXPECT_THAT(r.graph().notes, Contains(HasSubstr("n0/a does not publish b in the graph")));
}

}  // namespace
}  // namespace hotpath
