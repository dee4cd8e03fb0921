// SPDX-License-Identifier: Apache-2.0
// Timers that are cancelled, reset, changed, dropped or driven by another clock.
#include <rcl/time.h>
#include <rcl/timer.h>

#include <atomic>

#include "executors.hpp"

namespace hotpath::test {
namespace {

INSTANTIATE_TEST_SUITE_P(Executors, EveryExecutor, testing::ValuesIn(executor_names()), case_name);

TEST_P(EveryExecutor, ACancelledTimerRunsNoMoreUntilItIsReset) {
  std::atomic_int ran{0}, other{0};
  const auto timer = node->create_wall_timer(2ms, [&] { ++ran; });
  const auto clock = node->create_wall_timer(2ms, [&] { ++other; });
  executor->add_node(node);
  const Spinning spinning(*executor);
  for (int round = 0; round < 3; ++round) {
    const int before = ran;
    ASSERT_TRUE(eventually([&] { return ran >= before + 2; })) << round;
    timer->cancel();
    std::this_thread::sleep_for(10ms);  // a callback may still be running
    const int cancelled = ran, tick = other;
    ASSERT_TRUE(eventually([&] { return other >= tick + 10; }));
    EXPECT_EQ(ran, cancelled);
    timer->reset();
  }
}

TEST_P(EveryExecutor, ATimerMayCancelItself) {
  if (GetParam() == "events") GTEST_SKIP() << "on a busy machine, rclcpp's executor runs queued events";
  std::atomic_int ran{0}, other{0};
  rclcpp::TimerBase::SharedPtr timer;
  timer = node->create_wall_timer(2ms, [&] {
    ++ran;
    timer->cancel();
  });
  const auto clock = node->create_wall_timer(2ms, [&] { ++other; });
  executor->add_node(node);
  const Spinning spinning(*executor);
  ASSERT_TRUE(eventually([&] { return other >= 10; }));
  EXPECT_EQ(ran, 1);
}

TEST_P(EveryExecutor, ATimerThatWasCancelledBeforeRunsAfterItsReset) {
  std::atomic_int ran{0};
  const auto timer = node->create_wall_timer(2ms, [&] { ++ran; });
  timer->cancel();
  executor->add_node(node);
  const Spinning spinning(*executor);
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(ran, 0);
  timer->reset();
  EXPECT_TRUE(eventually([&] { return ran >= 2; }));
}

TEST_P(EveryExecutor, AResetPostponesTheNextCall) {
  std::atomic_int ran{0};
  const auto timer = node->create_wall_timer(200ms, [&] { ++ran; });
  executor->add_node(node);
  const Spinning spinning(*executor);
  const auto begin = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - begin < 500ms) {
    timer->reset();
    std::this_thread::sleep_for(5ms);
  }
  EXPECT_LE(ran, 1);  // one call is possible if the machine stalled
  EXPECT_TRUE(eventually([&] { return ran >= 2; }));
}

TEST_P(EveryExecutor, AnotherPeriodCountsFromTheNextCallOn) {
  if (!is_ours(GetParam()) && GetParam() == "events") GTEST_SKIP() << "it sorts by outdated instants";
  std::atomic_int ran{0};
  const auto timer = node->create_wall_timer(20ms, [&] { ++ran; });
  executor->add_node(node);
  const Spinning spinning(*executor);
  ASSERT_TRUE(eventually([&] { return ran >= 1; }));
  std::int64_t before = 0;
  ASSERT_EQ(rcl_timer_exchange_period(timer->get_timer_handle().get(), 3'600'000'000'000, &before),
            RCL_RET_OK);
  const int changed = ran;
  std::this_thread::sleep_for(100ms);
  EXPECT_LE(ran, changed + 2);
}

TEST_P(EveryExecutor, ATimerThatIsDroppedIsForgotten) {
  std::atomic_int ran{0}, other{0};
  auto timer = node->create_wall_timer(1ms, [&] { ++ran; });
  const auto clock = node->create_wall_timer(2ms, [&] { ++other; });
  executor->add_node(node);
  const Spinning spinning(*executor);
  ASSERT_TRUE(eventually([&] { return ran >= 2; }));
  timer.reset();
  std::this_thread::sleep_for(10ms);
  const int dropped = ran, tick = other;
  ASSERT_TRUE(eventually([&] { return other >= tick + 5; }));
  EXPECT_EQ(ran, dropped);
}

/// A clock whose simulated time the test sets.
class SimulatedClock {
 public:
  SimulatedClock() : clock(std::make_shared<rclcpp::Clock>(RCL_ROS_TIME)) {
    const std::lock_guard lock(clock->get_clock_mutex());
    if (rcl_enable_ros_time_override(clock->get_clock_handle()) != RCL_RET_OK) std::abort();
  }
  void set(std::chrono::nanoseconds now) {
    const std::lock_guard lock(clock->get_clock_mutex());
    if (rcl_set_ros_time_override(clock->get_clock_handle(), now.count()) != RCL_RET_OK) std::abort();
  }
  const rclcpp::Clock::SharedPtr clock;
};

TEST_P(EveryExecutor, SimulatedTimeReleasesItsTimers) {
  if (GetParam() == "events") GTEST_SKIP() << "rclcpp's EventsExecutor sleeps in real time";
  SimulatedClock simulated;
  simulated.set(1s);
  std::atomic_int ran{0};
  const auto timer = rclcpp::create_timer(node, simulated.clock, rclcpp::Duration(100ms), [&] { ++ran; });
  executor->add_node(node);
  const Spinning spinning(*executor);
  std::this_thread::sleep_for(150ms);
  EXPECT_EQ(ran, 0);  // time stands still
  for (int i = 1; i <= 5; ++i) {
    simulated.set(1s + i * 100ms);
    EXPECT_TRUE(eventually([&] { return ran == i; })) << i;
  }
  simulated.set(10s + 50ms);  // one call replaces all missed calls
  EXPECT_TRUE(eventually([&] { return ran == 6; }));
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(ran, 6);
}

/// Drops the last pointer to a timer during its clock's jump callback, which holds the clock's
/// lock; the timer's destructor takes that lock.
TEST_P(EveryExecutor, ATimerMayEndWhileSimulatedTimeMoves) {
  if (!is_ours(GetParam())) GTEST_SKIP() << "only for hotpath's executors";
  SimulatedClock simulated;
  simulated.set(1s);
  executor->add_node(node);
  const Spinning spinning(*executor);
  std::atomic_bool ends{false};
  std::thread moves([&] {
    for (int i = 1; !ends; ++i) simulated.set(1s + i * 1ms);
  });
  for (int i = 0; i < 200; ++i) {
    auto timer = rclcpp::create_timer(node, simulated.clock, rclcpp::Duration(1ms), [] {});
    std::this_thread::yield();
    timer.reset();
  }
  ends = true;
  moves.join();
}

TEST_P(EveryExecutor, EdfOrdersSimulatedTimersByTheirDeadlines) {
  if (GetParam() != "edf-ro" && GetParam() != "edf-re") GTEST_SKIP() << "not EDF";
  SimulatedClock simulated;
  simulated.set(1s);
  std::vector<int> order;
  const auto slow =
      rclcpp::create_timer(node, simulated.clock, rclcpp::Duration(300ms), [&] { order.push_back(300); });
  const auto fast =
      rclcpp::create_timer(node, simulated.clock, rclcpp::Duration(100ms), [&] { order.push_back(100); });
  executor->add_node(node);
  executor->spin_some();
  for (int round = 1; round <= 5; ++round) {
    order.clear();
    simulated.set(1s + round * 300ms);  // both timers are due
    while (order.size() < 2) executor->spin_some();
    EXPECT_EQ(order, (std::vector<int>{100, 300})) << round;
  }
}

TEST_P(EveryExecutor, TimersOfTheSystemsClockRun) {
  std::atomic_int ran{0};
  const auto clock = std::make_shared<rclcpp::Clock>(RCL_SYSTEM_TIME);
  const auto timer = rclcpp::create_timer(node, clock, rclcpp::Duration(2ms), [&] { ++ran; });
  const auto ros = rclcpp::create_timer(node, node->get_clock(), rclcpp::Duration(2ms), [&] { ++ran; });
  executor->add_node(node);
  const Spinning spinning(*executor);
  EXPECT_TRUE(eventually([&] { return ran >= 10; }));
}

/// Every nominal instant has its callback even if the executor is late: release-only queues
/// timestamps that rcl would skip. Only a delay of the timer thread itself loses instants.
TEST_P(EveryExecutor, ReleaseOnlyLosesNoTimestamp) {
  if (!is_ours(GetParam()) || GetParam().find("-ro") == std::string::npos) GTEST_SKIP() << "not release-only";
  std::mutex mutex;
  std::vector<std::uint64_t> sequences;
  bool held_up = false;
  std::uint64_t skipped = 0;
  const auto timer = node->create_wall_timer(5ms, [&] {
    const std::lock_guard lock(mutex);
    const auto running = PriorityExecutor::running_callback();
    ASSERT_TRUE(running);
    skipped += running->skipped;
    sequences.push_back(running->sequence);
    if (!std::exchange(held_up, true)) std::this_thread::sleep_for(250ms);
  });
  executor->add_node(node);
  {
    const Spinning spinning(*executor);
    ASSERT_TRUE(eventually([&] {
      const std::lock_guard lock(mutex);
      return sequences.size() >= 60;
    }));
  }
  EXPECT_EQ(sequences.back() + 1, sequences.size() + skipped);
  EXPECT_LT(skipped, 25U);  // half of the timestamps during the executor's delay
  EXPECT_FALSE(PriorityExecutor::running_callback());
}

TEST(Offsets, TimersOfTheGraphStartOnTheirGrid) {
  rclcpp::init(0, nullptr);
  {
    PriorityExecutorOptions options;
    options.graph = std::string(HOTPATH_TEST_DIR) + "/imported.yaml";
    options.offsets = std::string(HOTPATH_TEST_DIR) + "/offsets.csv";
    PriorityExecutor executor(options);
    std::vector<std::chrono::nanoseconds> fast_at, slow_at;
    const auto at = [] { return PriorityExecutor::running_callback()->timestamp; };
    const auto fast = std::make_shared<rclcpp::Node>("source", "fast");
    const auto slow = std::make_shared<rclcpp::Node>("source", "slow");
    const auto of_fast = fast->create_wall_timer(10ms, [&] { fast_at.push_back(at()); });
    const auto of_slow = slow->create_wall_timer(100ms, [&] { slow_at.push_back(at()); });
    executor.add_node(fast);
    executor.add_node(slow);
    ASSERT_TRUE(eventually([&] {
      executor.spin_once(10ms);
      return slow_at.size() >= 3 && fast_at.size() >= 3;
    }));
    for (const auto instant : fast_at) EXPECT_EQ(instant % 10ms, 2500us);
    for (const auto instant : slow_at) EXPECT_EQ(instant % 100ms, 40ms);
    options.graph.clear();
    EXPECT_THROW(PriorityExecutor{options}, std::invalid_argument);
    options.graph = "autoware";  // it has other timers
    EXPECT_THROW(PriorityExecutor{options}, std::runtime_error);
  }
  rclcpp::shutdown();
}

}  // namespace
}  // namespace hotpath::test
