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

TEST(RecordedGraph, ServicesWithTenRequestsAreTasks) {
  for (const int requests : {9, 10}) {
    Recorded r;
    r.system.topics = {{"/service", {}}};
    r.callback(K::timer, 0);
    r.callback(K::service, 0, 0);
    r.job(0, 0, 0ms, 1ms);
    for (int i = 0; i < requests; ++i) r.job(1, 0, (i + 1) * 10ms, (i + 1) * 10ms + 1ms);
    EXPECT_EQ(r.graph().task_of.at(1) != kNoTask, requests == 10);
  }
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
