// SPDX-License-Identifier: Apache-2.0
// Counts the callbacks of every kind of entity under every executor.
#include <atomic>
#include <composition_interfaces/srv/list_nodes.hpp>
#include <condition_variable>
#include <mutex>
#include <std_msgs/msg/int32.hpp>

#include "executors.hpp"

namespace hotpath::test {
namespace {

using std_msgs::msg::Int32;
using Service = composition_interfaces::srv::ListNodes;

INSTANTIATE_TEST_SUITE_P(Executors, EveryExecutor, testing::ValuesIn(executor_names()), case_name);

Int32 message(int value) {
  Int32 m;
  m.data = value;
  return m;
}

TEST_P(EveryExecutor, RunsATimer) {
  std::atomic_int ran{0};
  const auto timer = node->create_wall_timer(5ms, [&] { ++ran; });
  executor->add_node(node);
  const Spinning spinning(*executor);
  EXPECT_TRUE(eventually([&] { return ran >= 5; }));
}

TEST_P(EveryExecutor, DeliversEverySampleInOrder) {
  std::vector<int> got;
  std::atomic_size_t count{0};
  const auto subscription = node->create_subscription<Int32>("topic", 100, [&](Int32::ConstSharedPtr m) {
    got.push_back(m->data);
    ++count;
  });
  const auto publisher = node->create_publisher<Int32>("topic", 100);
  executor->add_node(node);
  const Spinning spinning(*executor);
  ASSERT_TRUE(eventually([&] { return publisher->get_subscription_count() == 1; }));
  for (int i = 0; i < 50; ++i) publisher->publish(message(i));
  ASSERT_TRUE(eventually([&] { return count == 50; }));
  for (int i = 0; i < 50; ++i) EXPECT_EQ(got[static_cast<std::size_t>(i)], i);
}

TEST_P(EveryExecutor, DeliversWhatWasPublishedBeforeItSpun) {
  std::atomic_int count{0};
  const auto subscription =
      node->create_subscription<Int32>("topic", 10, [&](Int32::ConstSharedPtr) { ++count; });
  const auto publisher = node->create_publisher<Int32>("topic", 10);
  ASSERT_TRUE(eventually([&] { return publisher->get_subscription_count() == 1; }));
  for (int i = 0; i < 5; ++i) publisher->publish(message(i));
  executor->add_node(node);
  const Spinning spinning(*executor);
  EXPECT_TRUE(eventually([&] { return count == 5; }));
}

TEST_P(EveryExecutor, OutlivesASubscriptionWhoseEventsAreHeld) {
  if (!is_ours(GetParam())) GTEST_SKIP() << "the middleware calls rclcpp's callback, which is freed";
  int got = 0;
  auto subscription = node->create_subscription<Int32>("topic", 10, [&](Int32::ConstSharedPtr) { ++got; });
  const auto publisher = node->create_publisher<Int32>("topic", 10);
  executor->add_node(node);
  ASSERT_TRUE(eventually([&] { return publisher->get_subscription_count() == 1; }));
  const auto held = subscription->get_event_handlers();  // these keep the rcl handle alive
  ASSERT_FALSE(held.empty());
  subscription.reset();
  for (int i = 0; i < 3; ++i) publisher->publish(message(i));
  executor->spin_some();
  EXPECT_EQ(got, 0);
}

TEST_P(EveryExecutor, DeliversWithinTheProcess) {
  const auto options = rclcpp::NodeOptions().use_intra_process_comms(true);
  const auto inner = std::make_shared<rclcpp::Node>("intra", options);
  std::atomic_int count{0};
  const auto subscription =
      inner->create_subscription<Int32>("intra", 10, [&](std::unique_ptr<Int32>) { ++count; });
  const auto publisher = inner->create_publisher<Int32>("intra", 10);
  executor->add_node(inner);
  const Spinning spinning(*executor);
  for (int i = 0; i < 30; ++i) {
    publisher->publish(std::make_unique<Int32>(message(i)));
    EXPECT_TRUE(eventually([&] { return count == i + 1; })) << i;
  }
}

TEST_P(EveryExecutor, DeliversSerializedMessages) {
  std::atomic_int count{0};
  const auto subscription = node->create_subscription<Int32>(
      "topic", 10, [&](std::shared_ptr<rclcpp::SerializedMessage> m) { count += m->size() > 0 ? 1 : 0; });
  const auto publisher = node->create_publisher<Int32>("topic", 10);
  executor->add_node(node);
  const Spinning spinning(*executor);
  ASSERT_TRUE(eventually([&] { return publisher->get_subscription_count() == 1; }));
  publisher->publish(publisher->borrow_loaned_message());
  EXPECT_TRUE(eventually([&] { return count == 1; }));
}

TEST_P(EveryExecutor, ServesRequestsAndAnswers) {
  std::atomic_int served{0}, answered{0};
  const auto service = node->create_service<Service>(
      "service", [&](Service::Request::SharedPtr, Service::Response::SharedPtr) { ++served; });
  const auto client = node->create_client<Service>("service");
  executor->add_node(node);
  const Spinning spinning(*executor);
  ASSERT_TRUE(client->wait_for_service(10s));
  for (int i = 0; i < 10; ++i) {
    client->async_send_request(std::make_shared<Service::Request>(),
                               [&](rclcpp::Client<Service>::SharedFuture) { ++answered; });
  }
  EXPECT_TRUE(eventually([&] { return served == 10 && answered == 10; }));
}

TEST_P(EveryExecutor, TellsOfQosEvents) {
#if !RCLCPP_VERSION_GTE(21, 0, 0)
  if (is_ours(GetParam())) GTEST_SKIP() << "rmw_fastrtps of Humble crashes when it calls back";
#endif
  std::atomic_int incompatible{0};
  rclcpp::PublisherOptions options;
  options.event_callbacks.incompatible_qos_callback = [&](auto&) { ++incompatible; };
  const auto publisher = node->create_publisher<Int32>("topic", rclcpp::QoS(1).best_effort(), options);
  executor->add_node(node);
  const Spinning spinning(*executor);
  const auto subscription =
      node->create_subscription<Int32>("topic", rclcpp::QoS(1).reliable(), [](Int32::ConstSharedPtr) {});
  EXPECT_TRUE(eventually([&] { return incompatible >= 1; }));
}

/// A typical user-written waitable with a guard condition.
class Waitable : public rclcpp::Waitable {
 public:
  std::atomic_int executed{0};
  rclcpp::GuardCondition condition;

  std::size_t get_number_of_ready_guard_conditions() override { return 1; }
#if RCLCPP_VERSION_GTE(28, 0, 0)
  void add_to_wait_set(rcl_wait_set_t& wait_set) override { condition.add_to_wait_set(wait_set); }
  bool is_ready(const rcl_wait_set_t& wait_set) override { return ready(wait_set); }
  void execute(const std::shared_ptr<void>&) override { ++executed; }
#else
  void add_to_wait_set(rcl_wait_set_t* wait_set) override { condition.add_to_wait_set(wait_set); }
  bool is_ready(rcl_wait_set_t* wait_set) override { return ready(*wait_set); }
  void execute(std::shared_ptr<void>&) override { ++executed; }
#endif
  std::shared_ptr<void> take_data() override { return nullptr; }
  std::shared_ptr<void> take_data_by_entity_id(std::size_t) override { return nullptr; }
  void set_on_ready_callback(std::function<void(std::size_t, int)> callback) override {
    condition.set_on_trigger_callback([callback](std::size_t count) { callback(count, 0); });
  }
  void clear_on_ready_callback() override { condition.set_on_trigger_callback(nullptr); }

 private:
  bool ready(const rcl_wait_set_t& wait_set) const {
    for (std::size_t i = 0; i < wait_set.size_of_guard_conditions; ++i) {
      if (wait_set.guard_conditions[i] == &condition.get_rcl_guard_condition()) return true;
    }
    return false;
  }
};

TEST_P(EveryExecutor, RunsAGuardConditionsWaitable) {
  const auto waitable = std::make_shared<Waitable>();
  rclcpp::CallbackGroup::SharedPtr free_group;
  // rclcpp loses a trigger that ends one thread's wait while another thread runs a job of the group.
  if (GetParam() == "multi")
    free_group = node->create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive);
  node->get_node_waitables_interface()->add_waitable(waitable, free_group);
  executor->add_node(node);
  const Spinning spinning(*executor);
  for (int i = 0; i < 20; ++i) {
    if (free_group) {
      ASSERT_TRUE(eventually([&] { return free_group->can_be_taken_from().load(); }));
    }
    waitable->condition.trigger();
    ASSERT_TRUE(eventually([&] { return waitable->executed == i + 1; })) << i << ": " << waitable->executed;
  }
}

TEST_P(EveryExecutor, TakesUpWhatComesWhileItSpins) {
  executor->add_node(node);
  const Spinning spinning(*executor);
  std::atomic_int timer_ran{0}, got{0}, other_ran{0};
  const auto timer = node->create_wall_timer(2ms, [&] { ++timer_ran; });
  const auto subscription =
      node->create_subscription<Int32>("topic", 10, [&](Int32::ConstSharedPtr) { ++got; });
  const auto publisher = node->create_publisher<Int32>("topic", 10);
  ASSERT_TRUE(eventually([&] { return publisher->get_subscription_count() == 1; }));
  publisher->publish(message(1));
  EXPECT_TRUE(eventually([&] { return timer_ran >= 1 && got == 1; }));
  const auto other = std::make_shared<rclcpp::Node>("other");
  const auto other_timer = other->create_wall_timer(2ms, [&] { ++other_ran; });
  executor->add_node(other);
  EXPECT_TRUE(eventually([&] { return other_ran >= 2; }));
  executor->remove_node(other);
  const int after_removal = other_ran;
  const int timer_before = timer_ran;
  EXPECT_TRUE(eventually([&] { return timer_ran >= timer_before + 20; }));
  EXPECT_LE(other_ran, after_removal + 1);  // one callback may already have started
}

TEST_P(EveryExecutor, ServesGroupsThatAreAddedByHand) {
  const auto group = node->create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive, false);
  std::atomic_int ran{0}, late{0};
  const auto timer = node->create_wall_timer(
      2ms, [&] { ++ran; }, group);
  executor->add_callback_group(group, node->get_node_base_interface());
  const Spinning spinning(*executor);
  EXPECT_TRUE(eventually([&] { return ran >= 2; }));
  const auto second = node->create_wall_timer(
      2ms, [&] { ++late; }, group);
  EXPECT_TRUE(eventually([&] { return late >= 2; }));
  EXPECT_THROW(executor->add_callback_group(group, node->get_node_base_interface()), std::runtime_error);
  executor->remove_callback_group(group);
  EXPECT_TRUE(eventually([&] { return !group->get_associated_with_executor_atomic().load(); }));
}

TEST_P(EveryExecutor, KeepsAMutuallyExclusiveGroupApart) {
  if (GetParam().find("-re") != std::string::npos) GTEST_SKIP() << "its timer thread ignores callback groups";
  if (GetParam() == "multi") GTEST_SKIP() << "it may forget the group for ever (rclcpp 3240)";
  std::atomic_int inside{0}, together{0}, ran{0};
  const auto callback = [&] {
    if (++inside > 1) ++together;
    for (int chances = 0; chances < 100; ++chances) std::this_thread::yield();  // each may take a time slice
    --inside;
    ++ran;
  };
  const auto a = node->create_wall_timer(2ms, callback);
  const auto b = node->create_wall_timer(2ms, callback);
  executor->add_node(node);
  const Spinning spinning(*executor);
  EXPECT_TRUE(eventually([&] { return ran >= 30; }));
  EXPECT_EQ(together, 0);
}

TEST_P(EveryExecutor, RunsAReentrantGroupInSeveralThreads) {
  if (GetParam() != "rm-ro:2" && GetParam() != "multi") GTEST_SKIP() << "one thread, or one job of a group";
  const auto group = node->create_callback_group(rclcpp::CallbackGroupType::Reentrant);
  std::mutex mutex;
  std::condition_variable entered;
  int inside = 0;
  std::atomic_bool together{false};
  const auto callback = [&] {
    std::unique_lock lock(mutex);
    ++inside;
    entered.notify_all();
    if (entered.wait_for(lock, 200ms, [&] { return inside >= 2; })) together = true;
    --inside;
  };
  const auto a = node->create_wall_timer(5ms, callback, group);
  const auto b = node->create_wall_timer(5ms, callback, group);
  executor->add_node(node);
  const Spinning spinning(*executor);
  EXPECT_TRUE(eventually([&] { return together.load(); }));
}

TEST_P(EveryExecutor, MovesToAnotherExecutorWithWhatIsQueued) {
  if (GetParam() == "events") GTEST_SKIP() << "rclcpp's EventsExecutor loses queued messages";
  std::atomic_int got{0};
  const auto subscription =
      node->create_subscription<Int32>("topic", 10, [&](Int32::ConstSharedPtr) { ++got; });
  const auto publisher = node->create_publisher<Int32>("topic", 10);
  ASSERT_TRUE(eventually([&] { return publisher->get_subscription_count() == 1; }));
  executor->add_node(node);
  const auto second = make_executor(GetParam());
  EXPECT_THROW(second->add_node(node), std::runtime_error);
  for (int i = 0; i < 3; ++i) publisher->publish(message(i));
  executor->remove_node(node);
  second->add_node(node);
  const Spinning spinning(*second);
  EXPECT_TRUE(eventually([&] { return got == 3; }));
}

}  // namespace
}  // namespace hotpath::test
