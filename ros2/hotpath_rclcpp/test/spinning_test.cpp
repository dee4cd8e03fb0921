// SPDX-License-Identifier: Apache-2.0
// Spinning, stopping and failing.
#include <atomic>
#include <future>
#include <hotpath_rclcpp_interfaces/action/count.hpp>
#include <rclcpp_action/rclcpp_action.hpp>
#include <std_msgs/msg/int32.hpp>

#include "executors.hpp"

namespace hotpath::test {
namespace {

using std_msgs::msg::Int32;

static_assert(!std::is_abstract_v<PriorityExecutor>);
static_assert(std::is_base_of_v<rclcpp::Executor, PriorityExecutor>);

INSTANTIATE_TEST_SUITE_P(Executors, EveryExecutor, testing::ValuesIn(executor_names()), case_name);

/// Calls every spinning function of rclcpp::Executor through the base class: a function that fails
/// to override does no work.
TEST_P(EveryExecutor, EveryWayToSpinDoesWork) {
  std::atomic_int ran{0};
  const auto timer = node->create_wall_timer(1ms, [&] { ++ran; });
  const auto ran_more = [&](const auto& spin) {
    const int before = ran;
    return eventually([&] {
      spin();
      return ran > before;
    });
  };
  EXPECT_TRUE(ran_more([&] { executor->spin_node_some(node); }));
  EXPECT_TRUE(ran_more([&] { executor->spin_node_once(node, 100ms); }));
  executor->add_node(node);
  EXPECT_TRUE(ran_more([&] { executor->spin_some(); }));
  EXPECT_TRUE(ran_more([&] { executor->spin_some(5ms); }));
  EXPECT_TRUE(ran_more([&] { executor->spin_all(5ms); }));
  EXPECT_TRUE(ran_more([&] { executor->spin_once(); }));
  EXPECT_TRUE(ran_more([&] { executor->spin_once(50ms); }));
  EXPECT_TRUE(ran_more([&] {
    std::promise<void> never;
    executor->spin_until_future_complete(never.get_future(), 20ms);
  }));
  EXPECT_TRUE(ran_more([&] {
    const Spinning spinning(*executor);
    std::this_thread::sleep_for(20ms);
  }));
  EXPECT_THROW(executor->spin_all(-1ms), std::invalid_argument);
}

TEST_P(EveryExecutor, SpinsUntilAFutureIsComplete) {
  std::promise<int> promise;
  const auto future = promise.get_future().share();
  int ran = 0;
  const auto timer = node->create_wall_timer(1ms, [&] {
    if (++ran == 3) promise.set_value(ran);
  });
  executor->add_node(node);
  EXPECT_EQ(executor->spin_until_future_complete(future, 10s), rclcpp::FutureReturnCode::SUCCESS);
  EXPECT_EQ(future.get(), 3);
}

TEST_P(EveryExecutor, SpinOnceWaitsNoLongerThanItIsTold) {
  executor->add_node(node);
  std::chrono::nanoseconds waited{};
  EXPECT_TRUE(eventually([&] {  // first, a new node receives its own parameter events
    const auto before = std::chrono::steady_clock::now();
    executor->spin_once(20ms);
    waited = std::chrono::steady_clock::now() - before;
    return waited >= 15ms;
  }));
  executor->spin_once(0ms);  // returns
}

TEST_P(EveryExecutor, RefusesToSpinTwice) {
  std::atomic_bool refused{false};
  const auto timer = node->create_wall_timer(1ms, [&] {
    try {
      executor->spin_some();
    } catch (const std::runtime_error&) {
      refused = true;
    }
  });
  executor->add_node(node);
  const Spinning spinning(*executor);
  EXPECT_TRUE(eventually([&] { return refused.load(); }));
}

TEST_P(EveryExecutor, IsCancelledFromACallbackAndSpinsAgain) {
  for (int round = 0; round < 3; ++round) {
    int ran = 0;
    const auto timer = node->create_wall_timer(1ms, [&] {
      ++ran;
      executor->cancel();
    });
    if (round == 0) executor->add_node(node);
    executor->spin();
    EXPECT_GE(ran, 1);
    EXPECT_FALSE(executor->is_spinning());
  }
}

TEST_P(EveryExecutor, ShutdownFromACallbackEndsIt) {
  const auto timer = node->create_wall_timer(1ms, [] { rclcpp::shutdown(); });
  executor->add_node(node);
  executor->spin();
  EXPECT_FALSE(rclcpp::ok());
}

TEST_P(EveryExecutor, AnExceptionLeavesSpinAndNothingIsLost) {
  if (GetParam() == "multi" || GetParam() == "events") GTEST_SKIP() << "rclcpp terminates the program";
  int got = 0;
  const auto subscription = node->create_subscription<Int32>("topic", 10, [&](Int32::ConstSharedPtr m) {
    if (m->data == 0) throw std::runtime_error("thrown by a callback");
    ++got;
  });
  const auto publisher = node->create_publisher<Int32>("topic", 10);
  executor->add_node(node);
  ASSERT_TRUE(eventually([&] { return publisher->get_subscription_count() == 1; }));
  for (int i = 0; i < 4; ++i) {
    Int32 m;
    m.data = i;
    publisher->publish(m);
  }
  EXPECT_THROW(executor->spin(), std::runtime_error);
  EXPECT_FALSE(executor->is_spinning());
  EXPECT_TRUE(eventually([&] {
    executor->spin_some();
    return got == 3;
  }));
}

TEST_P(EveryExecutor, AnExceptionOfATimerLeavesSpin) {
  if (GetParam() == "multi" || GetParam() == "events") GTEST_SKIP() << "rclcpp terminates the program";
  const auto timer = node->create_wall_timer(1ms, [] { throw std::runtime_error("thrown by a timer"); });
  executor->add_node(node);
  EXPECT_THROW(executor->spin(), std::runtime_error);
}

TEST_P(EveryExecutor, SpinSomeEndsThoughACallbackKeepsTheQueueFull) {
  int got = 0;
  const auto publisher = node->create_publisher<Int32>("topic", 10);
  const auto subscription = node->create_subscription<Int32>("topic", 10, [&](Int32::ConstSharedPtr m) {
    ++got;
    publisher->publish(*m);
  });
  executor->add_node(node);
  ASSERT_TRUE(eventually([&] { return publisher->get_subscription_count() == 1; }));
  publisher->publish(Int32());
  EXPECT_TRUE(eventually([&] {
    executor->spin_some();  // returns
    return got >= 3;
  }));
}

TEST_P(EveryExecutor, TwoSpinInOneProcess) {
  const auto other = std::make_shared<rclcpp::Node>("other");
  const auto second = make_executor(GetParam());
  std::atomic_int pings{0}, pongs{0};
  const auto ping = node->create_publisher<Int32>("ping", 10);
  const auto pong = other->create_publisher<Int32>("pong", 10);
  const auto on_ping = other->create_subscription<Int32>("ping", 10, [&](Int32::ConstSharedPtr m) {
    ++pings;
    pong->publish(*m);
  });
  const auto on_pong = node->create_subscription<Int32>("pong", 10, [&](Int32::ConstSharedPtr m) {
    if (++pongs < 20) ping->publish(*m);
  });
  executor->add_node(node);
  second->add_node(other);
  ASSERT_TRUE(
      eventually([&] { return ping->get_subscription_count() + pong->get_subscription_count() == 2; }));
  const Spinning a(*executor), b(*second);
  ping->publish(Int32());
  EXPECT_TRUE(eventually([&] { return pings == 20 && pongs == 20; }));
}

TEST_P(EveryExecutor, GoesWithItsNodesAlive) {
  const auto timer = node->create_wall_timer(1ms, [] {});
  const auto publisher = node->create_publisher<Int32>("topic", 10);
  const auto subscription = node->create_subscription<Int32>("topic", 10, [](Int32::ConstSharedPtr) {});
  executor->add_node(node);
  executor->spin_some();
  executor = make_executor(GetParam());
  publisher->publish(Int32());
  timer->reset();
  executor->add_node(node);  // the destroyed executor released it
  executor->spin_some();
}

TEST_P(EveryExecutor, GoesAfterItsContextWithGroupsThatWereAddedByHand) {
  const auto group = node->create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive, false);
  const auto timer = node->create_wall_timer(
      1ms, [] {}, group);
  executor->add_callback_group(group, node->get_node_base_interface());
  executor->spin_some();
  rclcpp::shutdown();
  executor.reset();
  EXPECT_FALSE(group->get_associated_with_executor_atomic().load());
}

TEST_P(EveryExecutor, RunsAnAction) {
  using Count = hotpath_rclcpp_interfaces::action::Count;
  using Goal = rclcpp_action::ServerGoalHandle<Count>;
  std::atomic_int feedback{0}, reached{0};
  const auto server = rclcpp_action::create_server<Count>(
      node, "count",
      [](const rclcpp_action::GoalUUID&, std::shared_ptr<const Count::Goal>) {
        return rclcpp_action::GoalResponse::ACCEPT_AND_EXECUTE;
      },
      [](std::shared_ptr<Goal>) { return rclcpp_action::CancelResponse::ACCEPT; },
      [](std::shared_ptr<Goal> goal) {
        for (int i = 1; i <= goal->get_goal()->to; ++i) {
          auto now = std::make_shared<Count::Feedback>();
          now->now = i;
          goal->publish_feedback(now);
        }
        auto result = std::make_shared<Count::Result>();
        result->reached = goal->get_goal()->to;
        goal->succeed(result);
      });
  const auto client = rclcpp_action::create_client<Count>(node, "count");
  executor->add_node(node);
  const Spinning spinning(*executor);
  ASSERT_TRUE(client->wait_for_action_server(10s));
  rclcpp_action::Client<Count>::SendGoalOptions options;
  options.feedback_callback = [&](auto, auto) { ++feedback; };
  options.result_callback = [&](const auto& result) { reached = result.result->reached; };
  Count::Goal goal;
  goal.to = 3;
  client->async_send_goal(goal, options);
  EXPECT_TRUE(eventually([&] { return reached == 3; }));
}

}  // namespace
}  // namespace hotpath::test
