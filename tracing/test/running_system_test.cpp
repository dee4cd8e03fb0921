// SPDX-License-Identifier: Apache-2.0
// The assembly of a system that runs for days: processes, subscriptions and timers end and return.
#include <gtest/gtest.h>

#include <algorithm>

#include "handmade_trace.hpp"

namespace hotpath::tracing::running_system_test {

constexpr std::size_t kMostEntities = 100;
constexpr std::uint32_t kSource = 7, kSink = 8;  // processes

/// A source that publishes to a sink in another process.
class RunningSystem : public testing::Test, protected Recording {
 protected:
  RunningSystem() : Recording(kMostEntities) {
    make_source();
    process = kSink;
    make_sink(2);
  }
  /// The source publishes so many samples.
  void publish(int times = 1) {
    process = kSource;
    for (; times > 0; --times) Recording::publish(next(), ++stamp);
  }
  /// The sink receives an earlier sample.
  void receive(std::uint64_t stamped) {
    process = kSink;
    Recording::receive(next(), stamped);
  }
  /// Samples that the sink receives at once.
  void pass(int times = 1) {
    for (; times > 0; --times) {
      publish();
      receive(stamp);
    }
  }
  std::int64_t next() { return now += 1000; }
  const System& system() const { return assembler.system(); }
  std::uint64_t strangers() const { return system().callbacks[1].strangers; }

  std::uint64_t stamp = 5000;
  std::int64_t now = 1000;
};

TEST_F(RunningSystem, LosesSamplesOfADiscoveredPublisher) {
  pass();
  publish(5);
  EXPECT_EQ(overwritten, (std::vector<std::uint64_t>{1, 2, 3}));
}

TEST_F(RunningSystem, DoesNotLoseWhatWasPublishedBeforeDiscovery) {
  publish(5);
  receive(stamp);
  pass(5);
  EXPECT_TRUE(overwritten.empty());
  EXPECT_EQ(strangers(), 0U);
}

TEST_F(RunningSystem, DoesNotLoseForeverWhatNeverArrived) {
  pass();
  publish();  // lost in transit
  pass(5);
  publish(2);
  EXPECT_TRUE(overwritten.empty()) << "a sample that is published last is unread at most";
  publish();
  EXPECT_EQ(overwritten.size(), 1U);
}

TEST_F(RunningSystem, MatchesTakesOfSeveralThreadsInAnyOrder) {
  publish();
  pass();
  receive(stamp - 1);
  EXPECT_EQ(strangers(), 0U);
  EXPECT_TRUE(overwritten.empty());
}

TEST_F(RunningSystem, AProcessThatHasEndedGetsNoSamples) {
  pass();
  publish();
  assembler.forget_process(kSink);
  publish(5);
  EXPECT_TRUE(overwritten.empty());
  EXPECT_EQ(system().callbacks[1].samples, 2U);
  EXPECT_EQ(system().processes, (std::set<std::uint32_t>{kSource}));
  EXPECT_EQ(system().ended_processes, 1U);
  process = kSink;
  make_sink(2);  // respawned, at the same addresses
  pass();
  EXPECT_EQ(jobs.back().ref.callback, 2U);
  EXPECT_EQ(jobs.back().sample.parent.callback, 0U);
}

TEST_F(RunningSystem, AProcessThatHasEndedGivesUpItsJobs) {
  process = kSink;
  tell(K::callback_start, next(), {21});
  assembler.forget_process(kSink);
  ASSERT_EQ(jobs.size(), 1U);
  EXPECT_FALSE(jobs[0].ended);
  EXPECT_TRUE(std::ranges::none_of(system().threads, [](const Thread& t) { return t.process == kSink; }));
}

/// Addresses are used again once their subscription has been destroyed.
TEST_F(RunningSystem, ASubscriptionAtTheAddressOfAnotherReplacesIt) {
  pass();
  process = kSink;
  tell(K::subscription_init, next(), {20, 2, 33, 2}, {"/a", ""});
  tell(K::subscription_init, next(), {30, 2, 33, 2}, {"/a", ""});
  EXPECT_EQ(system().topics[0].subscriptions, (std::vector<std::uint32_t>{3}));
}

TEST_F(RunningSystem, ASubscriptionThatItsNodeCreatedAnewLosesNothingUntilItTakes) {
  pass();
  process = kSink;
  tell(K::subscription_init, next(), {30, 2, 33, 100}, {"/a", ""});
  publish(5);
  EXPECT_TRUE(overwritten.empty()) << "it may have been destroyed";
  receive(stamp);
  publish(5);
  EXPECT_EQ(overwritten.size(), 3U) << "both live";
  EXPECT_EQ(strangers(), 0U);
}

TEST_F(RunningSystem, TimersThatFollowOneAnotherAreOneCallback) {
  process = kSource;
  const auto create = [&](std::uint64_t timer, std::uint64_t period) {
    tell(K::timer_init, next(), {timer, period});
    tell(K::timer_callback_added, next(), {timer, timer + 1});
    tell(K::timer_link_node, next(), {timer, 1});
    tell(K::callback_start, next(), {timer + 1});
    tell(K::callback_end, next(), {timer + 1});
    return jobs.back().ref.callback;
  };
  const std::uint32_t waiting = create(100, 50);
  EXPECT_NE(create(200, 50), waiting) << "both live";
  EXPECT_NE(create(100, 70), waiting) << "it has another period";
  EXPECT_EQ(create(300, 50), waiting) << "which has ended";
  EXPECT_EQ(system().callbacks[waiting].created, at(now - 4000));
  EXPECT_EQ(system().callbacks[waiting].node, 0U);
  for (std::uint64_t i = 0; i < 1000; ++i) create(100 + 100 * (i % 3), 50);
  EXPECT_LE(system().callbacks.size(), 6U);
  EXPECT_EQ(system().ignored, 0U);
}

TEST_F(RunningSystem, IgnoresEntitiesForWhichThereIsNoRoom) {
  for (std::uint64_t i = 0; i < 1000; ++i)
    tell(K::subscription_init, next(), {1000 + i, 2, 3000 + i, 1}, {"/b", ""});
  EXPECT_LE(system().callbacks.size(), kMostEntities);
  EXPECT_GT(system().ignored, 900U);
}

TEST_F(RunningSystem, LimitsUnknownCallbacks) {
  for (std::uint64_t i = 0; i < 100'000; ++i) {
    tell(K::callback_start, next(), {1'000'000 + i});
    tell(K::callback_end, next(), {1'000'000 + i});
  }
  EXPECT_LT(system().callbacks.size(), 20'000U);
  EXPECT_GT(system().ignored, 80'000U);
}

TEST_F(RunningSystem, LimitsTheMessagesOfAJob) {
  process = kSource;
  tell(K::callback_start, next(), {11});
  for (int i = 0; i < 100'000; ++i) tell(K::rcl_publish, next(), {13, 99});
  tell(K::callback_end, next(), {11});
  EXPECT_LT(jobs[0].published.size(), 10'000U);
  EXPECT_EQ(jobs[0].published.back().at, at(now - 1000));
}

}  // namespace hotpath::tracing::running_system_test
