// SPDX-License-Identifier: Apache-2.0
// What an executor writes to the log: one line, and each warning once, with names and a remedy.
#include <algorithm>
#include <atomic>
#include <std_msgs/msg/int32.hpp>

#include "executors.hpp"

namespace hotpath::test {
namespace {

using std_msgs::msg::Int32;

class NoticesTest : public testing::Test {
 protected:
  void SetUp() override {
    rclcpp::init(0, nullptr);
    node = std::make_shared<rclcpp::Node>("node");
  }
  void TearDown() override {
    node.reset();
    rclcpp::shutdown();
  }
  static std::vector<std::string> warnings(const Logged& logged, const std::string& part) {
    return logged.lines(RCUTILS_LOG_SEVERITY_WARN, part);
  }

  rclcpp::Node::SharedPtr node;
};

/// Works for `duration` of real time.
void work(std::chrono::nanoseconds duration) {
  const auto end = std::chrono::steady_clock::now() + duration;
  while (std::chrono::steady_clock::now() < end) continue;
}

TEST_F(NoticesTest, OneLineNamesTheMostUrgentAndNothingIsRepeated) {
  const auto logger = "hotpath_rclcpp";
  ASSERT_EQ(rcutils_logging_set_logger_level(logger, RCUTILS_LOG_SEVERITY_DEBUG), RCUTILS_RET_OK);
  const Logged logged;
  PriorityExecutor executor{"rm-ro"};
  std::vector<rclcpp::TimerBase::SharedPtr> timers;
  for (int ms = 20; ms < 35; ++ms) {
    timers.push_back(node->create_wall_timer(std::chrono::milliseconds(ms), [] {}));
  }
  const auto publisher = node->create_publisher<Int32>("late", 10);
  const auto subscription = node->create_subscription<Int32>("late", 10, [](Int32::ConstSharedPtr) {});
  std::atomic_bool publishes{false};
  timers.push_back(node->create_wall_timer(50ms, [&] {
    if (publishes) publisher->publish(Int32());
  }));
  executor.add_node(node);
  const Spinning spinning(executor);
  const auto infos = [&] { return logged.lines(RCUTILS_LOG_SEVERITY_INFO); };
  const auto debugged = [&](const std::string& text) {
    return !logged.lines(RCUTILS_LOG_SEVERITY_DEBUG, text).empty();
  };
  ASSERT_TRUE(eventually([&] { return !infos().empty(); }));
  const std::string line = infos().front();
  const std::size_t callbacks = executor.priority_order().size();
  EXPECT_NE(line.find("serves " + std::to_string(callbacks) + " callbacks"), std::string::npos) << line;
  EXPECT_NE(line.find("/node@Timer(20000000): 20000000 ns, /node@Timer(21000000)"), std::string::npos)
      << line;
  EXPECT_NE(line.find("/node@Timer(29000000)"), std::string::npos) << line;
  EXPECT_EQ(line.find("/node@Timer(30000000)"), std::string::npos) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  EXPECT_TRUE(debugged("/node@Service(/node/get_parameters): last"));
  publishes = true;  // the order changes: the log has it at DEBUG only
  EXPECT_TRUE(eventually([&] { return debugged("/node@Subscription(/late): 50000000 ns"); }));
  EXPECT_EQ(infos().size(), 1U);
  EXPECT_TRUE(warnings(logged, "").empty()) << testing::PrintToString(warnings(logged, ""));
  ASSERT_EQ(rcutils_logging_set_logger_level(logger, RCUTILS_LOG_SEVERITY_UNSET), RCUTILS_RET_OK);
}

TEST_F(NoticesTest, InputsWhoseOriginIsNotLearntAreNamedOnce) {
  for (const std::string name : {"rm-ro", "edf-ro"}) {
    const Logged logged;
    PriorityExecutor executor{name};
    const auto inner = node->create_publisher<Int32>("inner", 10);
    const auto outer = node->create_publisher<Int32>("outer", 10);
    std::atomic_int got_outer{0};
    const auto of_inner = node->create_subscription<Int32>("inner", 10, [](Int32::ConstSharedPtr) {});
    const auto of_outer =
        node->create_subscription<Int32>("outer", 10, [&](Int32::ConstSharedPtr) { ++got_outer; });
    const auto timer = node->create_wall_timer(10ms, [&] { inner->publish(Int32()); });
    executor.add_node(node);
    {
      const Spinning spinning(executor);
      EXPECT_TRUE(eventually([&] {
        outer->publish(Int32());  // by a thread that runs no callback
        return !warnings(logged, "run last").empty();
      }));
      const int before = got_outer;
      EXPECT_TRUE(eventually([&] {
        outer->publish(Int32());
        return got_outer > before + 100;
      }));
    }
    executor.remove_node(node);
    const std::vector<std::string> found = warnings(logged, "run last");
    ASSERT_EQ(found.size(), 1U) << testing::PrintToString(found);
    EXPECT_NE(found[0].find("/node@Subscription(/outer). "), std::string::npos) << found[0];
    EXPECT_EQ(found[0].find("inner"), std::string::npos) << found[0];
    EXPECT_EQ(found[0].find("parameter_events"), std::string::npos) << found[0];
    EXPECT_NE(found[0].find("option `graph`"), std::string::npos) << found[0];
  }
}

TEST_F(NoticesTest, GivenPrioritiesThatAreMissingAreReportedOnce) {
  const auto said = [&](bool given) {
    const Logged logged;
    PriorityExecutor executor{"fp-ro"};
    const auto timer = node->create_wall_timer(1ms, [&] { executor.cancel(); });
    if (given) executor.set_priority(timer, 1);
    executor.add_node(node);
    executor.spin();
    executor.spin();
    executor.remove_node(node);
    return warnings(logged, "fp-ro has no priorities").size();
  };
  EXPECT_EQ(said(false), 1U);
  EXPECT_EQ(said(true), 0U);
}

TEST_F(NoticesTest, CallbacksThatWaitForManyPeriodsAreNamedOnce) {
  const Logged logged;
  PriorityExecutor executor{"fp-ro"};
  std::atomic_int starved{0}, ran{0};
  const auto hog = node->create_wall_timer(20ms, [] { work(30ms); });
  const auto never = node->create_wall_timer(7ms, [&] { ++starved; });
  executor.set_priority(hog, 1);
  executor.set_priority(never, 2);
  executor.add_node(node);
  const Spinning spinning(executor);
  EXPECT_TRUE(eventually([&] { return !warnings(logged, "/node@Timer(7000000) (").empty(); }));
  const int before = starved;
  EXPECT_TRUE(eventually([&] { return !warnings(logged, "/node@Timer(20000000) (").empty(); }));
  EXPECT_EQ(warnings(logged, "/node@Timer(7000000) (").size(), 1U);
  EXPECT_LE(starved, before + 1);
  const auto found = warnings(logged, "ten of their periods");
  ASSERT_FALSE(found.empty());
  EXPECT_NE(found[0].find("hotpath advise"), std::string::npos) << found[0];
}

}  // namespace
}  // namespace hotpath::test
