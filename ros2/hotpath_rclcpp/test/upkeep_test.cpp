// SPDX-License-Identifier: Apache-2.0
// Entities that are created, removed or moved while an executor is busy or waits.
#include <malloc.h>
#include <sched.h>

#include <atomic>
#include <future>
#include <rcl_interfaces/srv/list_parameters.hpp>
#include <std_msgs/msg/int32.hpp>

#include "executors.hpp"

namespace hotpath::test {
namespace {

using std_msgs::msg::Int32;

INSTANTIATE_TEST_SUITE_P(Executors, EveryExecutor, testing::ValuesIn(executor_names()), case_name);

TEST_P(EveryExecutor, ACallbackMayWaitForAClientThatItMakes) {
  if (GetParam() != "rm-ro:2" && GetParam() != "multi") GTEST_SKIP() << "one thread";
  using rcl_interfaces::srv::ListParameters;
  const auto own = node->create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive);
  std::atomic_int waited{0}, answered{0};
  rclcpp::TimerBase::SharedPtr timer;
  timer = node->create_wall_timer(
      5ms,
      [&] {
        const auto group = node->create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive);
        const auto client =
            node->create_client<ListParameters>("/node/list_parameters", rclcpp::ServicesQoS(), group);
        if (!client->wait_for_service(5s)) return;
        auto answer = client->async_send_request(std::make_shared<ListParameters::Request>());
        answered += answer.future.wait_for(5s) == std::future_status::ready ? 1 : 0;
        if (++waited == 8) timer->cancel();  // by then, each thread has waited
      },
      own);
  executor->add_node(node);
  const Spinning spinning(*executor);
  ASSERT_TRUE(eventually([&] { return waited >= 1; }));
  EXPECT_TRUE(eventually([&] { return waited == 8; }));
  EXPECT_EQ(answered, waited);
}

TEST_P(EveryExecutor, ATimerThatIsResetEndsAWait) {
  if (GetParam() == "events") GTEST_SKIP() << "rclcpp's EventsExecutor does not";
  std::atomic_int ran{0};
  const auto timer = node->create_wall_timer(1ms, [&] { ++ran; });
  timer->cancel();
  executor->add_node(node);
  std::promise<void> never;
  auto future = never.get_future().share();
  std::thread resets([&] {
    std::this_thread::sleep_for(100ms);
    timer->reset();
  });
  executor->spin_until_future_complete(future, 500ms);
  resets.join();
  EXPECT_GE(ran, 2);
}

TEST_P(EveryExecutor, ATimerWithoutAPeriodLeavesRoom) {
  if (!is_ours(GetParam())) GTEST_SKIP() << "only for hotpath's executors";
  std::atomic_int ran{0}, other{0}, stale{0};
  std::chrono::nanoseconds ended{};
  const auto always = node->create_wall_timer(0ms, [&] {
    const auto running = PriorityExecutor::running_callback();
    if (running && running->release < ended) ++stale;  // released while the previous job was pending
    std::this_thread::sleep_for(1ms);
    ++ran;
    ended = std::chrono::steady_clock::now().time_since_epoch();
  });
  const auto timer = node->create_wall_timer(5ms, [&] { ++other; });
  executor->add_node(node);
  const Spinning spinning(*executor);
  EXPECT_TRUE(eventually([&] { return ran >= 20 && other >= 5; }));
  EXPECT_EQ(stale, 0);
}

TEST_P(EveryExecutor, ANodeThatMovesTakesAllItsMessagesAlong) {
  if (!is_ours(GetParam())) GTEST_SKIP() << "only for hotpath's executors";
  constexpr int kMessages = 600;
  int got = 0;
  const auto subscription =
      node->create_subscription<Int32>("topic", kMessages, [&](Int32::ConstSharedPtr) { ++got; });
  const auto publisher = node->create_publisher<Int32>("topic", kMessages);
  executor->add_node(node);
  ASSERT_TRUE(eventually([&] { return publisher->get_subscription_count() == 1; }));
  for (int i = 0; i < kMessages; ++i) publisher->publish(Int32());
  executor->remove_node(node);
  const auto second = make_executor(GetParam());
  second->add_node(node);
  EXPECT_TRUE(eventually([&] {
    second->spin_some();
    return got == kMessages;
  })) << got;
}

/// Messages that are overwritten before they are taken leave events without a sample; spin_some()
/// removes them.
TEST_P(EveryExecutor, ALoopOfSpinSomeNeedsNoMoreAndMoreMemory) {
  if (!is_ours(GetParam())) GTEST_SKIP() << "only for hotpath's executors";
  int got = 0;
  const auto subscription =
      node->create_subscription<Int32>("topic", 1, [&](Int32::ConstSharedPtr) { ++got; });
  const auto publisher = node->create_publisher<Int32>("topic", 1);
  executor->add_node(node);
  ASSERT_TRUE(eventually([&] { return publisher->get_subscription_count() == 1; }));
  const auto rounds = [&](int count) {
    for (; count > 0; --count) {
      for (int i = 0; i < 20; ++i) publisher->publish(Int32());
      executor->spin_some();
    }
    return mallinfo2().uordblks;
  };
  const std::size_t before = rounds(50);
  EXPECT_LT(rounds(1000), before + 1'000'000);  // 19000 leftover events would need more
  EXPECT_GT(got, 500);
}

/// Lacks set_on_ready_callback(): an events executor cannot serve it.
class Mute : public rclcpp::Waitable {
 public:
#if RCLCPP_VERSION_GTE(28, 0, 0)
  void add_to_wait_set(rcl_wait_set_t&) override {}
  bool is_ready(const rcl_wait_set_t&) override { return false; }
  void execute(const std::shared_ptr<void>&) override {}
#else
  void add_to_wait_set(rcl_wait_set_t*) override {}
  bool is_ready(rcl_wait_set_t*) override { return false; }
  void execute(std::shared_ptr<void>&) override {}
#endif
  std::shared_ptr<void> take_data() override { return nullptr; }
#if RCLCPP_VERSION_GTE(29, 0, 0)  // which has no defaults; this is what they did
  std::shared_ptr<void> take_data_by_entity_id(std::size_t) override { return nullptr; }
  void set_on_ready_callback(std::function<void(std::size_t, int)>) override {
    throw std::runtime_error("not overridden");
  }
  void clear_on_ready_callback() override {}
#endif
};

TEST_P(EveryExecutor, ANodeThatItCannotServeIsNotAdded) {
  if (!is_ours(GetParam())) GTEST_SKIP() << "only for hotpath's executors";
  const auto mute = std::make_shared<Mute>();
  node->get_node_waitables_interface()->add_waitable(mute, nullptr);
  EXPECT_THROW(executor->add_node(node), std::runtime_error);
  EXPECT_FALSE(node->get_node_base_interface()->get_associated_with_executor_atomic().load());
  EXPECT_TRUE(executor->get_all_callback_groups().empty());
  rclcpp::executors::SingleThreadedExecutor other;
  other.add_node(node);  // another executor may add it
  other.remove_node(node);
}

TEST_P(EveryExecutor, ItsThreadsKeepThePolicyOfItsCaller) {
  if (GetParam() != "rm-ro:2") GTEST_SKIP() << "one thread";
  executor->add_node(node);
  std::thread caller([&] {
    const sched_param none{};
    ASSERT_EQ(sched_setscheduler(0, SCHED_BATCH, &none), 0);  // needs no permission
    executor->spin();
  });
  std::vector<std::string> policies;
  EXPECT_TRUE(eventually([&] { return !(policies = ours().thread_policies()).empty(); }));
  executor->cancel();
  caller.join();
  ASSERT_EQ(policies.size(), 3U);
  EXPECT_EQ(policies[0], "executor batch");
  EXPECT_EQ(policies[1], "executor batch");
  EXPECT_NE(policies[2], "timer_mgmt other");
}

}  // namespace
}  // namespace hotpath::test
