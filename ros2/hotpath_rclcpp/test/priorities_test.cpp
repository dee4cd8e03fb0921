// SPDX-License-Identifier: Apache-2.0
// The order of callbacks, and error messages for invalid priorities.
#include <algorithm>
#include <atomic>
#include <composition_interfaces/srv/list_nodes.hpp>
#include <filesystem>
#include <fstream>
#include <std_msgs/msg/int32.hpp>

#include "executors.hpp"

namespace hotpath::test {
namespace {

using std_msgs::msg::Int32;
using Service = composition_interfaces::srv::ListNodes;

class Priorities : public testing::Test {
 protected:
  void SetUp() override {
    rclcpp::init(0, nullptr);
    node = std::make_shared<rclcpp::Node>(
        "node", rclcpp::NodeOptions().start_parameter_services(false).start_parameter_event_publisher(false));
  }
  void TearDown() override {
    node.reset();
    rclcpp::shutdown();
  }
  static PriorityExecutorOptions options(const std::string& executor) {
    PriorityExecutorOptions o;
    o.executor = executor;
    return o;
  }
  /// Position of this callback in the order.
  static std::ptrdiff_t place(const PriorityExecutor& executor, const std::string& id) {
    const std::vector<std::string> order = executor.priority_order();
    const auto found = std::find_if(order.begin(), order.end(),
                                    [&](const std::string& text) { return text.rfind(id + ":", 0) == 0; });
    EXPECT_NE(found, order.end()) << id;
    return found - order.begin();
  }
  /// The order without callbacks that have no priority, such as the services that rclcpp adds to
  /// every node.
  static std::vector<std::string> given_order(const PriorityExecutor& executor) {
    std::vector<std::string> order = executor.priority_order();
    order.erase(
        std::remove_if(order.begin(), order.end(),
                       [](const std::string& text) { return text.find(": last") != std::string::npos; }),
        order.end());
    return order;
  }
  template <class Callback>
  rclcpp::SubscriptionBase::SharedPtr subscribe(const std::string& topic, Callback callback) {
    return node->create_subscription<Int32>(topic, 10, callback);
  }

  rclcpp::Node::SharedPtr node;
};

TEST_F(Priorities, TheShorterPeriodRunsFirst) {
  PriorityExecutor executor{"rm-ro"};
  std::vector<char> ran;
  // Created in the wrong order, both due at once, before the executor spins.
  const auto slow = node->create_wall_timer(30ms, [&] { ran.push_back('s'); });
  const auto fast = node->create_wall_timer(10ms, [&] { ran.push_back('f'); });
  executor.add_node(node);
  ASSERT_TRUE(eventually([&] { return slow->is_ready() && fast->is_ready(); }));
  executor.spin_some();
  ASSERT_GE(ran.size(), 2U);
  EXPECT_EQ(ran[0], 'f');
  EXPECT_EQ(ran[1], 's');
}

TEST_F(Priorities, ASubscriptionLearnsThePriorityOfWhoPublishes) {
  for (const bool intra_process : {false, true}) {
    const auto inner = std::make_shared<rclcpp::Node>(
        intra_process ? "intra" : "inter", rclcpp::NodeOptions().use_intra_process_comms(intra_process));
    PriorityExecutor executor{"rm-ro"};
    const auto to_slow = inner->create_publisher<Int32>("of_slow", 10);
    const auto to_fast = inner->create_publisher<Int32>("of_fast", 10);
    const auto of_slow = inner->create_subscription<Int32>("of_slow", 10, [](Int32::ConstSharedPtr) {});
    const auto of_fast = inner->create_subscription<Int32>("of_fast", 10, [](Int32::ConstSharedPtr) {});
    const auto slow = inner->create_wall_timer(20ms, [&] { to_slow->publish(Int32()); });
    const auto fast = inner->create_wall_timer(10ms, [&] { to_fast->publish(Int32()); });
    executor.add_node(inner);
    ASSERT_TRUE(eventually([&] {
      executor.spin_some();
      return to_slow->get_subscription_count() + to_fast->get_subscription_count() == 2;
    }));
    std::vector<std::string> order;
    const std::string name = intra_process ? "/intra" : "/inter";
    const auto learnt = [&](const std::string& text) {
      order = executor.priority_order();
      return std::count(order.begin(), order.end(), name + text) > 0;
    };
    EXPECT_TRUE(eventually([&] {
      executor.spin_once(5ms);
      return learnt("@Subscription(/of_slow): 20000000 ns") && learnt("@Subscription(/of_fast): 10000000 ns");
    })) << testing::PrintToString(order);
  }
}

TEST_F(Priorities, NothingIsLearntWhenThatIsSwitchedOff) {
  auto o = options("rm-ro");
  o.learn = false;
  PriorityExecutor executor(o);
  const auto publisher = node->create_publisher<Int32>("topic", 10);
  int got = 0;
  const auto subscription = subscribe("topic", [&](Int32::ConstSharedPtr) { ++got; });
  const auto timer = node->create_wall_timer(2ms, [&] { publisher->publish(Int32()); });
  executor.add_node(node);
  ASSERT_TRUE(eventually([&] {
    executor.spin_once(5ms);
    return got >= 3;
  }));
  const auto order = executor.priority_order();
  EXPECT_EQ(std::count(order.begin(), order.end(), "/node@Subscription(/topic): last"), 1)
      << testing::PrintToString(order);
}

TEST_F(Priorities, AGraphGivesThem) {
  auto o = options("rm-ro");
  o.graph = "autoware";
  PriorityExecutor executor(o);
  const auto lidar = std::make_shared<rclcpp::Node>("PointsTransformerFront");
  const auto map = std::make_shared<rclcpp::Node>("PointCloudMapLoader");
  const auto subscription =
      lidar->create_subscription<Int32>("FrontLidarDriver", 1, [](Int32::ConstSharedPtr) {});
  const auto transformer = map->create_subscription<Int32>("PointCloudMap", 1, [](Int32::ConstSharedPtr) {});
  executor.add_node(lidar);
  executor.add_node(map);
  EXPECT_LT(place(executor, "/PointsTransformerFront@Subscription(/FrontLidarDriver)"),
            place(executor, "/PointCloudMapLoader@Subscription(/PointCloudMap)"));
}

/// Options with the graph whose nodes have namespaces.
PriorityExecutorOptions imported() {
  PriorityExecutorOptions o;
  o.graph = std::string(HOTPATH_TEST_DIR) + "/imported.yaml";
  return o;
}

TEST_F(Priorities, AnImportedGraphGivesThemInNamespaces) {
  PriorityExecutor executor(imported());
  std::vector<rclcpp::Node::SharedPtr> nodes;
  std::vector<rclcpp::SubscriptionBase::SharedPtr> subscriptions;
  const auto add = [&](const std::string& name_space, const std::string& name, const std::string& topic) {
    nodes.push_back(std::make_shared<rclcpp::Node>(name, name_space));
    subscriptions.push_back(nodes.back()->create_subscription<Int32>(topic, 1, [](Int32::ConstSharedPtr) {}));
    executor.add_node(nodes.back());
  };
  add("slow", "sink", "points");
  add("fast", "sink", "points");
  add("any", "lone", "/slow/points");
  add("any", "sink", "/fast/points");  // ambiguous: the graph has three nodes `sink`
  const std::vector<std::string> expected = {"/fast/sink@Subscription(/fast/points): 10000000 ns",
                                             "/slow/sink@Subscription(/slow/points): 100000000 ns",
                                             "/any/lone@Subscription(/slow/points): 100000000 ns"};
  EXPECT_EQ(given_order(executor), expected);
}

TEST_F(Priorities, AGraphWithNoneOfTheNodesIsSaid) {
  const auto said = [](const std::string& name_space) {
    const Logged logged;
    PriorityExecutor executor(imported());
    const auto sink = std::make_shared<rclcpp::Node>("sink", name_space);
    const auto timer = sink->create_wall_timer(1ms, [&] { executor.cancel(); });
    executor.add_node(sink);
    executor.spin();
    return logged.text();
  };
  const std::string warning = "graph imported has no node of this executor so far";
  const std::string of_misspelt = said("fats");
  EXPECT_NE(of_misspelt.find(warning), std::string::npos) << of_misspelt;
  EXPECT_NE(of_misspelt.find("/fats/sink: did you mean `fast.sink`?"), std::string::npos) << of_misspelt;
  EXPECT_EQ(said("fast").find(warning), std::string::npos);
}

TEST_F(Priorities, ByHandForEveryKind) {
  PriorityExecutor executor{"fp-ro"};
  const auto group = node->create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive);
  const auto timer = node->create_wall_timer(1s, [] {});
  const auto grouped = node->create_wall_timer(
      2s, [] {}, group);
  const auto subscription = subscribe("topic", [](Int32::ConstSharedPtr) {});
  const auto service = node->create_service<Service>(
      "service", [](Service::Request::SharedPtr, Service::Response::SharedPtr) {});
  const auto client = node->create_client<Service>("service");
  executor.set_priority(timer, 5);
  executor.set_priority(subscription, 4);
  executor.add_node(node);  // priorities are set before and after it
  executor.set_priority(std::static_pointer_cast<rclcpp::ServiceBase>(service), 3);
  executor.set_priority(std::static_pointer_cast<rclcpp::ClientBase>(client), 2);
  executor.set_priority(group, 1);
  const std::vector<std::string> expected = {"/node@Timer(2000000000): 1", "/node@Client(/service): 2",
                                             "/node@Service(/service): 3", "/node@Subscription(/topic): 4",
                                             "/node@Timer(1000000000): 5"};
  EXPECT_EQ(given_order(executor), expected);
  PriorityExecutor other{"rm-ro"};
  EXPECT_THROW(other.set_priority(timer, 1), std::invalid_argument);
}

TEST_F(Priorities, AFileGivesThem) {
  auto o = options("fp-ro");
  o.priorities = std::string(HOTPATH_TEST_DIR) + "/priorities.yaml";
  PriorityExecutor executor(o);
  std::vector<char> ran;
  const auto ten = node->create_wall_timer(10ms, [&] { ran.push_back('t'); });
  const auto twenty = node->create_wall_timer(20ms, [&] { ran.push_back('T'); });
  const auto b = subscribe("b", [](Int32::ConstSharedPtr) {});
  executor.add_node(node);
  const std::vector<std::string> expected = {"/node@Timer(20000000): 1", "/node@Subscription(/b): 2",
                                             "/node@Timer(10000000): 3"};
  EXPECT_EQ(given_order(executor), expected);
  ASSERT_TRUE(eventually([&] { return ten->is_ready() && twenty->is_ready(); }));
  executor.spin_some();
  ASSERT_GE(ran.size(), 2U);
  EXPECT_EQ(ran.front(), 'T');
}

/// The message of the exception that `make` throws; empty: none.
template <class Make>
std::string refusal(Make make) {
  try {
    make();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST_F(Priorities, WhatCannotBeIsRefusedInASentence) {
  const auto refused = [&](const PriorityExecutorOptions& o) {
    return refusal([&] { PriorityExecutor executor(o); });
  };
  EXPECT_NE(refused(options("x")).find("there is no executor `x`; choose one of: "), std::string::npos);
  EXPECT_NE(refused(options("rm-ol")).find("did you mean `rm-ro`?"), std::string::npos);
  EXPECT_NE(refused(options("default")).find("SingleThreadedExecutor"), std::string::npos);
  EXPECT_NE(refused(options("rm-ro:last")).find("no variant `last`"), std::string::npos);
  auto o = options("rm-re");
  o.threads = 2;
  EXPECT_NE(refused(o).find("cannot have 2 threads"), std::string::npos);
  o = options("rm-ro");
  o.priorities = "some.yaml";
  EXPECT_NE(refused(o).find("fp-ro"), std::string::npos);
  o = options("fp-ro");
  o.priorities = "/nowhere/some.yaml";
  EXPECT_NE(refused(o).find("/nowhere/some.yaml"), std::string::npos);
  o = options("rm-ro");
  o.graph = "nonsense";
  EXPECT_NE(refused(o).find("nonsense"), std::string::npos);
  o = options("rm-ro");
  o.timer_thread = "fifo:1000";
  EXPECT_NE(refused(o), "");
  o = options("rm-ro");
  o.middleware_threads = "fifo:1000";
  EXPECT_NE(refused(o), "");
}

class OptionsFile : public Priorities {
 protected:
  OptionsFile() : folder(std::filesystem::temp_directory_path() / ("hotpath_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder);
  }
  ~OptionsFile() override { std::filesystem::remove_all(folder); }
  PriorityExecutorOptions read(const std::string& text) const {
    std::ofstream(folder / "executor.yaml") << text;
    return PriorityExecutorOptions::from_file(folder / "executor.yaml");
  }
  const std::filesystem::path folder;
};

TEST_F(OptionsFile, HasAllOptions) {
  const auto all = read(
      "executor: fp-ro:first\nthreads: 2\ngraph: graph.yaml\npriorities: p.yaml\n"
      "offsets: /etc/phases.csv\nlearn: false\nservice_wait_ms: 2.5\n"
      "timer_thread: fifo:90\nexecutor_threads: other\nmiddleware_threads: rr:7\n");
  EXPECT_EQ(all.executor, "fp-ro:first");
  EXPECT_EQ(all.threads, 2U);
  EXPECT_EQ(all.graph, folder / "graph.yaml");
  EXPECT_EQ(all.priorities, folder / "p.yaml");
  EXPECT_EQ(all.offsets, "/etc/phases.csv");
  EXPECT_FALSE(all.learn);
  EXPECT_EQ(all.service_wait, 2500us);
  EXPECT_EQ(all.timer_thread, "fifo:90");
  EXPECT_EQ(all.executor_threads, "other");
  EXPECT_EQ(all.middleware_threads, "rr:7");
  EXPECT_EQ(read("graph: autoware\n").graph, "autoware");
}

TEST_F(OptionsFile, OrdersCallbacks) {
  std::filesystem::copy_file(std::string(HOTPATH_TEST_DIR) + "/imported.yaml", folder / "graph.yaml");
  PriorityExecutor executor(read("executor: rm-ro\nthreads: 1\ngraph: graph.yaml\n"));
  const auto sink = std::make_shared<rclcpp::Node>("sink", "/fast");
  const auto subscription = sink->create_subscription<Int32>("points", 10, [](Int32::ConstSharedPtr) {});
  executor.add_node(sink);
  const std::vector<std::string> order = executor.priority_order();
  EXPECT_EQ(std::ranges::count(order, "/fast/sink@Subscription(/fast/points): 10000000 ns"), 1);
}

TEST_F(OptionsFile, IsRejectedWithItsLine) {
  const auto refused = [&](const std::string& text) { return refusal([&] { read(text); }); };
  const std::string file = folder / "executor.yaml";
  EXPECT_EQ(refused("executor: rm-ro\nthread: 2\n").rfind(file + ":2: ", 0), 0U);
  EXPECT_NE(refused("executor: rm-ro\nthread: 2\n").find("threads"), std::string::npos);
  EXPECT_EQ(refused("executor: rm-ro\nthreads: no\n").rfind(file + ":2: ", 0), 0U);
  EXPECT_EQ(refused("learn: true\nexecutor: rm-r\n"),
            file + ":2: there is no executor `rm-r`; did you mean `rm-ro`?");
  EXPECT_EQ(refused("executor: rm-re\nthreads: 2\n").rfind(file + ":2: ", 0), 0U);
  EXPECT_EQ(refused("learn: perhaps\n").rfind(file + ":1: ", 0), 0U);
  EXPECT_EQ(refused("learn: false\ntimer_thread: fifo:1000\n").rfind(file + ":2: ", 0), 0U);
  EXPECT_EQ(refused("service_wait_ms: -1\n").rfind(file + ":1: ", 0), 0U);
  EXPECT_NE(refusal([&] { PriorityExecutorOptions::from_file(folder / "none.yaml"); }).find("none.yaml"),
            std::string::npos);
}

}  // namespace
}  // namespace hotpath::test
