// SPDX-License-Identifier: Apache-2.0
// Statistics, timestamps, and the events that are kept.
#include "watching.hpp"

namespace hotpath::watch::observer_test {

constexpr Duration kMs = std::chrono::milliseconds(1);

class Observing : public testing::Test {
 protected:
  void observe() {
    for (; observed < system.events.size(); ++observed) observer.event(system.events[observed]);
  }
  /// Of the timer.
  Duration longest_response() {
    observe();
    return observer.callbacks()[0].response.max();
  }
  WatchedSystem system;
  std::size_t observed = 0;
  FlightRecorder recorder{std::chrono::milliseconds(22)};
  Observer observer{{}, &recorder};
};

TEST_F(Observing, KeepsTimesAndLossesOfCallbacks) {
  system.run(10, 2);
  system.run(23, 4);                                           // 3 ms late
  for (int i = 3; i <= 6; ++i) system.run(10 * i, 1, i == 6);  // the last of four; depth 2
  observe();
  const CallbackObservation& timer = observer.callbacks()[0];
  EXPECT_EQ(timer.execution.count(), 6U);
  EXPECT_EQ(timer.lost, 0U);
  EXPECT_EQ(timer.execution.max(), 4 * kMs);
  EXPECT_EQ(timer.response.max(), 7 * kMs);
  const CallbackObservation& subscription = observer.callbacks()[1];
  EXPECT_EQ(subscription.execution.count(), 3U);
  EXPECT_EQ(subscription.lost, 2U);
  EXPECT_EQ(subscription.execution.max(), 1 * kMs);
  EXPECT_EQ(subscription.response.max(), 1 * kMs);
}

/// Publications of Humble have no source timestamps; those of takes are of the real-time clock.
TEST_F(Observing, MatchesSamplesOfHumble) {
  system.run(10, 2);
  constexpr Duration kRealtime = std::chrono::hours(1000);
  for (tracing::Event& event : system.events) {
    if (event.kind == tracing::EventKind::rmw_publish) event.number = {0, 99, 0};
    if (event.kind == tracing::EventKind::rmw_take)
      event.number[2] = static_cast<std::uint64_t>((at_ms(12.1) - Time{} + kRealtime).count());
  }
  system.events.back().at += kMs;
  observer.set_realtime(kRealtime, {});
  observe();
  EXPECT_EQ(observer.callbacks()[1].response.max(), 2 * kMs);
  EXPECT_EQ(observer.system().callbacks[1].strangers, 0U);
}

TEST_F(Observing, CountsFromATimersGridIfItAttachedLater) {
  system.run(1013, 2);
  system.run(1020, 1);
  Observer attached({}, nullptr, {}, at_ms(1000));
  for (const tracing::Event& event : system.events) attached.event(event);
  EXPECT_EQ(attached.callbacks()[0].response.max(), 5 * kMs);
  EXPECT_EQ(longest_response(), 1 * kMs) << "otherwise the first timestamp is unknown";
}

TEST_F(Observing, SkipsTimestampsLikeRcl) {
  system.run(10, 1);
  system.job(15, 30, 21);
  system.run(45, 1);  // due at 20; 30 and 40 are skipped
  system.run(50, 2);
  EXPECT_EQ(longest_response(), 26 * kMs);
  EXPECT_LT(observer.callbacks()[0].response.quantile(0.6), 3 * kMs);
}

TEST_F(Observing, CountsFromTheFirstJobAfterATimerWasReset) {
  system.run(10, 1);
  system.run(15, 1);  // before 20
  system.run(27, 1);  // 2 ms after 25
  EXPECT_EQ(longest_response(), 3 * kMs);
}

/// An executor that waits before each job of a thread.
class ObservingWaits : public Observing {
 protected:
  void wait(double ms) { system.add(tracing::EventKind::wait_for_work, ms, {}); }
  std::uint64_t responses() {
    observe();
    return observer.callbacks()[0].response.count();
  }
};

TEST_F(ObservingWaits, KnowNoTimestampIfTheTimerWasResetOrACallbackWithoutEventsRan) {
  wait(0);
  system.run(10, 1);
  wait(12);
  wait(30'000);
  system.run(30'010, 2);
  wait(30'013);
  system.run(30'022, 1);  // 2 ms late
  EXPECT_EQ(responses(), 2U);
  EXPECT_EQ(longest_response(), 3 * kMs);
}

TEST_F(ObservingWaits, CountFromTheJobIfTheThreadRanOthersMeanwhile) {
  for (int i = 0; i < 100; ++i) {
    wait(7 * i);
    system.job(7 * i + 1, 5, 21);
  }
  wait(700);
  system.run(701, 2);
  EXPECT_EQ(responses(), 1U);
  EXPECT_EQ(longest_response(), 2 * kMs);
}

TEST_F(ObservingWaits, CountALongJobBeforeATimer) {
  wait(0);
  system.job(1, 499, 21);
  wait(500);
  system.run(500.1, 1);
  EXPECT_EQ(responses(), 1U);
  EXPECT_EQ(longest_response(), std::chrono::microseconds(491'100));
}

TEST_F(ObservingWaits, KnowNoTimestampIfAnotherThreadMayHaveBlockedTheTimer) {
  wait(0);
  system.events.back().thread = 8;
  wait(0);
  wait(100);
  wait(200);
  system.run(210, 1);
  EXPECT_EQ(responses(), 0U);
}

TEST_F(Observing, CountsFromTheCreationOfATimerThatFollowsAnother) {
  system.run(10, 1);
  system.create_timer(15);
  system.run(27, 1);  // due at 25
  observe();
  EXPECT_EQ(observer.callbacks()[0].execution.count(), 2U);
  EXPECT_EQ(longest_response(), 3 * kMs);
}

TEST_F(Observing, RecordsTheLastDescriptionOfEachTimer) {
  for (int i = 1; i <= 100; ++i) system.create_timer(i);
  observe();
  const std::vector<tracing::Event> events = recorder.events();
  ASSERT_EQ(events.size(), 9U);
  EXPECT_EQ(events.back().kind, tracing::EventKind::timer_link_node);
  EXPECT_EQ(events.back().at, at_ms(100));
}

TEST_F(Observing, RecordsTheLastEventsWithTheirDescriptions) {
  for (int i = 1; i <= 20; ++i) system.run(10 * i, 2);
  observe();
  const std::vector<tracing::Event> events = recorder.events();
  EXPECT_TRUE(std::ranges::is_sorted(events, {}, &tracing::Event::at));
  ASSERT_EQ(events.size(), 9U + 3U * 7U - 1U) << "from 181 ms on: without the start of the job at 180 ms";
  EXPECT_EQ(events.front().kind, tracing::EventKind::timer_init);
  EXPECT_EQ(events.front().at, at_ms(180)) << "moved by whole periods";
  Observer again({}, nullptr);
  for (const tracing::Event& event : events) again.event(event);
  EXPECT_EQ(again.callbacks()[0].execution.count(), 2U);
  EXPECT_EQ(again.callbacks()[0].response.max(), 2 * kMs);
}

}  // namespace hotpath::watch::observer_test
