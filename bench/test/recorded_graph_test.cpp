// SPDX-License-Identifier: Apache-2.0
// The graph of a recorded system: its callback groups, services and cycles.
#include "import/recorded_graph.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>

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

/// The requests to a service in a trace with a timer, and the node that stands for their senders.
Node outside_of(const std::vector<Duration>& requests, Duration length = 0ms) {
  Recorded r;
  r.system.topics = {{"/service", {}}};
  r.callback(K::timer, 0);
  r.callback(K::service, 0, 0);
  r.job(0, 0, 0ms, 1ms);
  for (const Duration at : requests) {
    tracing::Job& job = r.job(1, 0, at, at + 1us);
    job.has_sample = true;
    job.sample.published = job.start;
  }
  if (length > 0ms) r.job(0, 0, length - 1ms, length);
  const imports::RecordedGraph graph = r.graph();
  EXPECT_TRUE(graph.tasks.set[graph.task_of.at(1)].guaranteed) << "a service";
  EXPECT_EQ(graph.graph.nodes.at(1).name, imports::kOutside);
  return graph.graph.nodes.at(1);
}

std::vector<Duration> arrivals(int number, const std::function<Duration(int)>& at) {
  std::vector<Duration> all;
  all.reserve(static_cast<std::size_t>(number));
  for (int i = 0; i < number; ++i) all.push_back(at(i));
  return all;
}

TEST(RecordedGraph, RegularRequestsComeFromOneTimer) {
  const Node outside = outside_of({10ms, 20ms, 30ms});
  ASSERT_EQ(outside.callbacks.size(), 1U);
  EXPECT_EQ(outside.callbacks[0].period, 10ms);
  EXPECT_EQ(outside.callbacks[0].phase, Duration(10ms));
}

TEST(RecordedGraph, AFewIrregularRequestsComeOnce) {
  for (const int number : {1, 9}) {
    const std::vector<Duration> at = arrivals(number, [](int i) { return 10ms * (i + 1) * (i + 1); });
    const Node outside = outside_of(at);
    ASSERT_EQ(outside.callbacks.size(), at.size());
    for (std::size_t i = 0; i < at.size(); ++i) {
      EXPECT_EQ(outside.callbacks[i].phase, at[i]);
      EXPECT_EQ(outside.callbacks[i].period, 1h);
    }
  }
}

/// Of a recording of a minute: requests with 1 ms between them after one second.
TEST(RecordedGraph, ABurstDoesNotRecurWithinTheRecording) {
  for (const int number : {3, 12, 500}) {
    const auto at = arrivals(number, [](int i) { return 1s + i * 1ms; });
    const Node outside = outside_of(at, 60s);
    double requests = 0;
    for (const Callback& timer : outside.callbacks)
      requests += std::ceil(to_ms(60s - *timer.phase) / to_ms(timer.period));
    EXPECT_LE(requests, number);
    EXPECT_EQ(outside.callbacks.size(), number == 500 ? 1U : at.size());
  }
}

TEST(RecordedGraph, RegularRequestsMayBeginLateAndEndBeforeTheRecording) {
  for (const Duration first : {0s, 40s}) {
    const Node outside =
        outside_of(arrivals(200, [first](int i) { return first + i * 100ms; }), first == 0s ? 35s : 60s);
    ASSERT_EQ(outside.callbacks.size(), 1U);
    EXPECT_EQ(outside.callbacks[0].period, 100ms);
  }
}

/// Bursts of five with 1 ms between them, every 500 ms.
TEST(RecordedGraph, BurstsKeepTheirInstantsAndRecur) {
  const std::vector<Duration> at = arrivals(20, [](int i) { return i / 5 * 500ms + i % 5 * 1ms; });
  const Duration shortest = (at.back() - at.front()) / 19 * 20;
  for (const Duration length : {Duration(1505ms), Duration(10s)}) {
    const Node outside = outside_of(at, length);
    ASSERT_EQ(outside.callbacks.size(), at.size());
    for (std::size_t i = 0; i < at.size(); ++i) {
      EXPECT_EQ(outside.callbacks[i].phase, at[i]);
      EXPECT_EQ(outside.callbacks[i].period, std::max(shortest, length));
    }
  }
}

/// The timers of very many arrivals take turns; every arrival is within the jitter of its turn.
TEST(RecordedGraph, JitterCoversVeryManyArrivals) {
  const std::vector<Duration> at = arrivals(500, [](int i) { return i / 5 * 500ms + i % 5 * 1ms; });
  const Node outside = outside_of(at);
  const std::size_t timers = outside.callbacks.size();
  ASSERT_LE(timers, 10U);
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Callback& timer = outside.callbacks[i % timers];
    EXPECT_LT(timer.release_jitter, timer.period);
    const Duration late = at[i] - *timer.phase - timer.period * static_cast<std::int64_t>(i / timers);
    EXPECT_TRUE(late >= 0ms && late <= timer.release_jitter) << i;
  }
}

TEST(RecordedGraph, OneTimerIsNamedInTheSingular) {
  std::vector<Time> at;
  at.reserve(200);
  for (int i = 0; i < 200; ++i) at.push_back(Time{} + i * 10ms + i % 2 * 2ms);
  const imports::OutsideReleases releases = imports::outside_releases(at, {at.front(), at.back()});
  ASSERT_EQ(releases.first.size(), 1U);
  EXPECT_THAT(releases.timers, testing::MatchesRegex("a timer of 10.0 ms with a release jitter of .*"));
}

TEST(RecordedGraph, TooManyArrivalsAtOnceHaveTheirMeanRate) {
  const Node outside = outside_of(arrivals(500, [](int i) { return i < 250 ? i * 1us : 10s + i * 1us; }));
  ASSERT_EQ(outside.callbacks.size(), 1U);
  EXPECT_EQ(outside.callbacks[0].release_jitter, 0ms);
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

/// The names that the graph would make are those of other topics, of a service and of a node.
TEST(RecordedGraph, NamesAreDifferent) {
  Recorded r;
  r.system.topics = {{"/a", {}}, {"/a", {}}, {"/a_2", {}}, {"/timer", {}}, {"/strange", {}}};
  r.callback(K::timer, 0);
  r.callback(K::service, 1, 0);
  for (const std::uint32_t topic : {1U, 1U, 2U, 3U}) r.callback(K::subscription, 1, topic);
  r.callback(K::timer, 1);
  r.callback(K::subscription, 2, 4);
  r.system.nodes[2] = "/outside";
  for (int i = 0; i < 10; ++i) {
    tracing::Job& job = r.job(0, 0, i * 10ms, i * 10ms + 1ms);
    for (const std::uint32_t topic : {1U, 2U, 3U}) job.published.push_back({topic, job.finish});
    for (std::uint32_t c = 1; c < 8; ++c) r.job(c, 0, i * 10ms + c * 1ms, i * 10ms + c * 1ms + 500us);
  }
  const imports::RecordedGraph graph = r.graph();
  std::vector<std::string> names;
  for (const Task& task : graph.tasks.set.tasks) names.push_back(task.name);
  EXPECT_THAT(names, testing::UnorderedElementsAre("n0/timer", "n1/a_3", "n1/a", "n1/a_2_2", "n1/a_2",
                                                   "n1/timer", "n1/timer_2", "outside_2/strange",
                                                   "outside/a_3", "outside/strange"));
  const auto name_of = [&](std::uint32_t c) { return graph.tasks.set[graph.task_of.at(c)].name; };
  EXPECT_EQ(name_of(4), "n1/a_2") << "a topic keeps its name before copies";
  std::vector<std::string> fed;
  for (const TaskId reader : graph.tasks.set[graph.task_of.at(0)].feeds)
    fed.push_back(graph.tasks.set[reader].name);
  EXPECT_THAT(fed, testing::UnorderedElementsAre("n1/a", "n1/a_2_2", "n1/a_2", "n1/timer"));
}

/// Nobody publishes the first topic, so that the second one has its name without a note.
TEST(RecordedGraph, TopicsOutsideOfTheGraphTakeNoNames) {
  Recorded r;
  r.system.topics = {{"/a", {}}, {"/a", {}}};
  r.callback(K::timer, 0);
  for (const std::uint32_t topic : {0U, 0U, 1U}) r.callback(K::subscription, 1, topic);
  for (int i = 0; i < 10; ++i) {
    r.job(0, 0, i * 10ms, i * 10ms + 1ms).published.push_back({1, Time{} + i * 10ms});
    r.job(3, 0, i * 10ms + 2ms, i * 10ms + 3ms);
  }
  const imports::RecordedGraph graph = r.graph();
  EXPECT_EQ(graph.tasks.set[graph.task_of.at(3)].name, "n1/a");
  EXPECT_THAT(graph.notes, testing::Each(HasSubstr("Nobody published /a")));
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
