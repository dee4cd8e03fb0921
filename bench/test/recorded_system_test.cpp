// SPDX-License-Identifier: Apache-2.0
// The executors of a recording, and who calls a service.
#include "import/recorded_system.hpp"

#include <gmock/gmock.h>

#include <functional>
#include <set>

#include "recorded.hpp"

namespace hotpath::recorded_system_test {

using namespace std::chrono_literals;
using K = tracing::CallbackKind;

/// One callback for each thread, of a node of its own.
std::vector<imports::RecordedExecutor> executors_of(
    const std::vector<std::tuple<std::uint32_t, std::uint32_t, K>>& threads) {  // processes, ids, callbacks
  RecordedCallbacks r;
  r.system.topics = {{"/t", {}}};
  for (const auto& [process, id, kind] : threads) {
    const auto t = static_cast<std::uint32_t>(r.system.threads.size());
    r.system.processes.insert(process);
    r.system.threads.push_back({process, id, 1, 0, {}});
    r.callback(kind, t, kind == K::timer ? tracing::kNone : 0).threads[t] = 1;
  }
  r.job(0, 0, 0ms, 1ms);
  return imports::recorded_system(r.system, r.jobs, {}, 0).executors;
}

TEST(RecordedExecutors, ThreadsOfTwoProcessesMayHaveOneId) {
  const auto found = executors_of({{7, 1, K::timer}, {8, 1, K::timer}});
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].name, "process_7_thread_1");
  EXPECT_EQ(found[1].name, "process_8_thread_1");
}

TEST(RecordedExecutors, ATimerThreadBelongsToTheOnlyOtherThreadOfItsProcess) {
  EXPECT_EQ(executors_of({{7, 1, K::timer}, {7, 2, K::subscription}}).size(), 1U);
  EXPECT_EQ(executors_of({{7, 1, K::timer}, {7, 2, K::subscription}, {7, 3, K::subscription}}).size(), 3U);
}

TEST(RecordedExecutors, UsualProcessorsRanOneInAHundredJobs) {
  const tracing::Thread thread{0, 1, 1000, 0, {{0, 981}, {2, 9}, {3, 10}}};
  EXPECT_EQ(imports::usual_processors(thread), (std::vector<std::int32_t>{0, 3}));
}

/// A service (callback 0) of node 0, and timers of node 1, which has a client of it. In each of 20 periods of
/// 50 ms, jobs of 1 ms start at these instants.
class ServiceCalls : public testing::Test {
 protected:
  ServiceCalls() {
    r_.system.topics = {{"/map", {}}};
    r_.system.clients = {{.node = 1, .service = 0}};
    r_.callback(K::service, 0, 0);
    for (int i = 0; i < 2; ++i) r_.callback(K::timer, 1);
  }
  /// Returns the sentences, and sets the callers.
  std::vector<std::string> attribute(
      const std::vector<std::pair<std::uint32_t, std::function<Duration(int)>>>& starts) {
    for (int i = 0; i < 20; ++i)
      for (const auto& [callback, start] : starts) {
        tracing::Job& job = r_.job(callback, 0, start(i), start(i) + 1ms);
        job.sample.published = job.start;
        job.started = static_cast<std::uint64_t>(start(i).count());
        job.waited = waits_.contains(start(i) % 50ms);
      }
    imports::RecordedSystem recorded = imports::recorded_system(r_.system, r_.jobs, {}, 0);
    r_.jobs = recorded.jobs;
    for (const tracing::Job& job : r_.jobs)
      if (job.ref.callback == 0) callers_.insert(job.sample.parent.callback);
    recorded_ = std::move(recorded);
    return recorded_.remarks[imports::Remark::assumed];
  }
  static std::function<Duration(int)> after(Duration offset) {
    return [offset](int i) { return i * 50ms + offset; };
  }

  RecordedCallbacks r_;
  std::set<std::uint32_t> callers_;
  std::set<Duration> waits_;  ///< Before jobs that start at these instants of a period.
  imports::RecordedSystem recorded_;
};

TEST_F(ServiceCalls, AreOfTheCallbackThatRanAsOften) {
  EXPECT_THAT(attribute({{1, after(0ms)}, {2, after(2ms)}, {2, after(4ms)}, {0, after(10ms)}}),
              testing::ElementsAre(testing::HasSubstr("node /n1 is taken to send the requests")));
  EXPECT_EQ(callers_, std::set<std::uint32_t>{1}) << "the other one ran too often, though nearer";
  EXPECT_EQ(r_.jobs.front().published.size(), 1U);
  EXPECT_EQ(r_.jobs.back().sample.published, r_.jobs.back().start - 9ms);
}

TEST_F(ServiceCalls, OfSeveralTheNearestIsTakenAndTheOthersAreOpen) {
  r_.system.callbacks[2].period = 20ms;
  EXPECT_THAT(attribute({{1, after(0ms)}, {2, after(5ms)}, {0, after(10ms)}}), testing::IsEmpty());
  EXPECT_EQ(callers_, std::set<std::uint32_t>{2});
  ASSERT_EQ(recorded_.open.size(), 1U);
  EXPECT_THAT(recorded_.open[0].callers, testing::ElementsAre("/n1 (timer 20 ms)", "/n1 (timer 10 ms)"));
  for (const tracing::Job& job : recorded_.with_caller(0, 1).jobs) {
    EXPECT_EQ(job.published.size(), job.ref.callback == 1 ? 1U : 0U);
    EXPECT_EQ(job.sample.parent.callback == 1, job.ref.callback == 0);
  }
}

TEST_F(ServiceCalls, AnExecutorServesRequestsInItsNextRound) {
  r_.callback(K::timer, 0);
  waits_ = {3ms, 4ms};
  std::vector<std::pair<std::uint32_t, std::function<Duration(int)>>> starts = {
      {1, after(0ms)}, {2, after(5ms)}, {2, after(30ms)}, {0, after(10ms)}};
  for (const int busy : {1, 2, 3, 4, 6, 7, 8, 9}) starts.emplace_back(3, after(busy * 1ms));
  EXPECT_THAT(attribute(starts), testing::ElementsAre(testing::HasSubstr("one in 2.")));
  EXPECT_EQ(callers_, std::set<std::uint32_t>{2}) << "two rounds have begun since the other one's jobs";
}

TEST_F(ServiceCalls, OneInThreeJobsMayCall) {
  // In most periods, the thread did not idle after the second job of the other callback.
  const auto second = [](int i) { return i * 50ms + (i % 3 == 0 ? 12ms : 21ms); };
  EXPECT_THAT(attribute({{1, after(0ms)},
                         {1, after(10ms)},
                         {1, after(20ms)},
                         {2, after(16ms)},
                         {2, second},
                         {0, after(21500us)}}),
              testing::ElementsAre(testing::HasSubstr("20 of 20 jobs of one of its callbacks, one in 3.")));
  EXPECT_EQ(callers_, std::set<std::uint32_t>{1}) << "the thread would have idled after the other one's jobs";
  for (const tracing::Job& job : r_.jobs) {
    const bool calls = job.ref.callback == 1 && job.ref.number % 3 == 2;
    EXPECT_EQ(job.published.size(), calls ? 1U : 0U) << job.ref.callback;
  }
}

TEST_F(ServiceCalls, AResponseIsNoRequest) {
  r_.system.topics.push_back({"/map/response", {}});
  r_.system.clients[0].response = 1;
  r_.callback(K::client, 1, 1);
  attribute({{1, after(0ms)}, {0, after(10ms)}, {3, after(12ms)}});
  EXPECT_EQ(callers_, std::set<std::uint32_t>{1});
}

TEST_F(ServiceCalls, WithoutARelationNobodyCalls) {
  EXPECT_TRUE(attribute({{1, after(0ms)}, {0, [](int i) { return i * i * 10ms + 10ms; }}}).empty());
  EXPECT_EQ(callers_, std::set<std::uint32_t>{tracing::kNone});
}

TEST_F(ServiceCalls, WithoutAClientNobodyCalls) {
  r_.system.clients.clear();
  EXPECT_TRUE(attribute({{1, after(0ms)}, {0, after(10ms)}}).empty());
  EXPECT_EQ(callers_, std::set<std::uint32_t>{tracing::kNone});
}

}  // namespace hotpath::recorded_system_test
