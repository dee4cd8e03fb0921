// SPDX-License-Identifier: Apache-2.0
// Services of a node whose timers need more time than there is.
#include <atomic>
#include <rcl_interfaces/srv/get_parameters.hpp>
#include <rcl_interfaces/srv/list_parameters.hpp>

#include "executors.hpp"

namespace hotpath::test {
namespace {

using rcl_interfaces::srv::GetParameters;
using Service = rcl_interfaces::srv::ListParameters;

/// A node with 30 ms of work every 20 ms under `options`, and a client in another executor.
class Overloaded {
 public:
  explicit Overloaded(const PriorityExecutorOptions& options) : executor_(options) {
    timer_ = node_->create_wall_timer(20ms, [this] {
      const auto end = std::chrono::steady_clock::now() + 30ms;
      while (std::chrono::steady_clock::now() < end) continue;
      ++ran_;
    });
    if (options.executor.rfind("fp", 0) == 0) executor_.set_priority(timer_, 1);
    executor_.add_node(node_);
    spinning_ = std::make_unique<Spinning>(executor_);
    client_ = asks_->create_client<GetParameters>("/busy/get_parameters");
  }
  /// Asks for a parameter, and waits for the answer until the timer has run `more` times.
  bool answers(int more) {
    if (!client_->wait_for_service(20s)) return false;
    const auto request = std::make_shared<GetParameters::Request>();
    request->names = {"use_sim_time"};
    auto answer = client_->async_send_request(request);
    const int before = ran_;
    while (ran_ < before + more) {
      if (rclcpp::spin_until_future_complete(asks_, answer, 10ms) == rclcpp::FutureReturnCode::SUCCESS)
        return true;
    }
    return false;
  }
  [[nodiscard]] bool is_behind() {
    return eventually([&] { return ran_ >= 4; });
  }

 private:
  PriorityExecutor executor_;
  rclcpp::Node::SharedPtr node_ = std::make_shared<rclcpp::Node>("busy");
  rclcpp::Node::SharedPtr asks_ = std::make_shared<rclcpp::Node>("asks");
  std::atomic_int ran_{0};
  rclcpp::TimerBase::SharedPtr timer_;
  rclcpp::Client<GetParameters>::SharedPtr client_;
  std::unique_ptr<Spinning> spinning_;
};

class Services : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { rclcpp::init(0, nullptr); }
  void TearDown() override { rclcpp::shutdown(); }
};

TEST_P(Services, AnOverloadedNodeAnswersEveryCall) {
  PriorityExecutorOptions options;
  options.executor = GetParam();
  Overloaded node(options);
  ASSERT_TRUE(node.is_behind());
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(node.answers(50)) << i;
}

TEST_P(Services, WithoutAWaitItAnswersNone) {
  PriorityExecutorOptions options;
  options.executor = GetParam();
  if (options.executor.find("-re") != std::string::npos) GTEST_SKIP() << "the timer has its own thread";
  options.service_wait = 0ns;
  Overloaded node(options);
  ASSERT_TRUE(node.is_behind());
  EXPECT_FALSE(node.answers(20));
}

INSTANTIATE_TEST_SUITE_P(Executors, Services,
                         testing::Values("rm-ro", "rm-re", "dm-ro", "edf-ro", "edf-re", "fp-ro", "fp-re"),
                         case_name);

TEST(ServicePriorities, AServiceAndAClientTakeAPlaceUnderEveryPolicy) {
  rclcpp::init(0, nullptr);
  for (const std::string name : {"rm-ro", "dm-re", "edf-ro"}) {
    PriorityExecutor executor{name};
    const auto node = std::make_shared<rclcpp::Node>("node");
    const auto fast = node->create_wall_timer(10ms, [] {});
    const auto slow = node->create_wall_timer(100ms, [] {});
    const auto service = std::static_pointer_cast<rclcpp::ServiceBase>(node->create_service<Service>(
        "service", [](Service::Request::SharedPtr, Service::Response::SharedPtr) {}));
    const auto client = std::static_pointer_cast<rclcpp::ClientBase>(node->create_client<Service>("service"));
    executor.set_priority(service, 20'000'000);
    executor.add_node(node);
    executor.set_priority(client, 500'000'000);
    executor.set_priority(client, 50'000'000);
    EXPECT_THROW(executor.set_priority(client, 0), std::invalid_argument);
    EXPECT_THROW(executor.set_priority(fast, 1), std::invalid_argument);
    if (name == "edf-ro") continue;
    std::vector<std::string> order = executor.priority_order();
    order.resize(4);
    EXPECT_EQ(order, (std::vector<std::string>{
                         "/node@Timer(10000000): 10000000 ns", "/node@Service(/service): 20000000 ns",
                         "/node@Client(/service): 50000000 ns", "/node@Timer(100000000): 100000000 ns"}))
        << name;
  }
  PriorityExecutor events{"events-ro"};
  const auto node = std::make_shared<rclcpp::Node>("node");
  const auto service = std::static_pointer_cast<rclcpp::ServiceBase>(node->create_service<Service>(
      "service", [](Service::Request::SharedPtr, Service::Response::SharedPtr) {}));
  EXPECT_THROW(events.set_priority(service, 1), std::invalid_argument);
  PriorityExecutorOptions options;
  options.service_wait = -1ns;
  EXPECT_THROW(PriorityExecutor{options}, std::invalid_argument);
  rclcpp::shutdown();
}

/// Two requests wait; the service with the earlier deadline answers first, although it was asked last.
TEST(ServicePriorities, UnderEdfThePlaceIsADeadline) {
  rclcpp::init(0, nullptr);
  {
    PriorityExecutor executor{"edf-ro"};
    const auto node = std::make_shared<rclcpp::Node>("node");
    std::vector<char> ran;
    const auto serve = [&](const std::string& name, char letter) {
      return node->create_service<Service>(
          name, [&ran, letter](Service::Request::SharedPtr, Service::Response::SharedPtr) {
            ran.push_back(letter);
          });
    };
    const auto late = serve("late", 'l');
    const auto soon = serve("soon", 's');
    const auto none = serve("none", 'n');
    executor.set_priority(std::static_pointer_cast<rclcpp::ServiceBase>(late), 100'000'000'000);
    executor.set_priority(std::static_pointer_cast<rclcpp::ServiceBase>(soon), 1'000'000'000);
    executor.add_node(node);
    const auto asks = std::make_shared<rclcpp::Node>("asks");
    std::vector<rclcpp::Client<Service>::SharedPtr> clients;
    for (const std::string name : {"late", "none", "soon"})
      clients.push_back(asks->create_client<Service>(name));
    for (const auto& client : clients) ASSERT_TRUE(client->wait_for_service(20s));
    for (const auto& client : clients) client->async_send_request(std::make_shared<Service::Request>());
    // Within one process, requests arrive before async_send_request() returns.
    ASSERT_TRUE(eventually([&] {
      executor.spin_some();
      return ran.size() == 3;
    }));
    EXPECT_EQ(ran, (std::vector<char>{'s', 'l', 'n'}));
  }
  rclcpp::shutdown();
}

}  // namespace
}  // namespace hotpath::test
