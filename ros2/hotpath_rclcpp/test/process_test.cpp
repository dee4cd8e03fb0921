// SPDX-License-Identifier: Apache-2.0
// What an executor does to its process: threads, wake-ups; and what it says of the libraries in it.
#include <dlfcn.h>
#include <rcutils/logging.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <std_msgs/msg/int32.hpp>

#include "executors.hpp"

namespace hotpath::test {
namespace {

using std_msgs::msg::Int32;

INSTANTIATE_TEST_SUITE_P(Executors, EveryExecutor, testing::ValuesIn(executor_names()), case_name);

std::string logged;
void keep(const rcutils_log_location_t*, int, const char*, rcutils_time_point_value_t, const char* format,
          va_list* arguments) {
  char text[1000];
  vsnprintf(text, sizeof text, format, *arguments);
  logged += text;
}

TEST(TwoFastDds, InOneProcessAreReported) {
  const auto made = [] {
    logged.clear();
    PriorityExecutor executor;
    return logged;
  };
  rclcpp::init(0, nullptr);
  const auto before = rcutils_logging_get_output_handler();
  rcutils_logging_set_output_handler(keep);
  EXPECT_EQ(made(), "");
  void* const second = dlopen(HOTPATH_NO_FASTDDS, RTLD_NOW);
  ASSERT_TRUE(second) << dlerror();
  EXPECT_NE(made().find("Two versions of Fast DDS are loaded, "), std::string::npos) << logged;
  dlclose(second);
  rcutils_logging_set_output_handler(before);
  rclcpp::shutdown();
}

TEST_P(EveryExecutor, SaysWhatItsThreadsObtained) {
  if (!is_ours(GetParam())) GTEST_SKIP() << "ours";
  EXPECT_TRUE(ours().thread_policies().empty());
  const Spinning spinning(*executor);
  std::vector<std::string> policies;
  ASSERT_TRUE(eventually([&] {
    policies = ours().thread_policies();
    return !policies.empty();
  }));
  EXPECT_EQ(policies.size(), GetParam().find(":2") == std::string::npos ? 2U : 3U);
  EXPECT_EQ(policies.front().rfind("executor ", 0), 0U) << policies.front();
  EXPECT_EQ(policies.back().rfind("timer_mgmt ", 0), 0U) << policies.back();
}

/// Voluntary context switches of a thread of this process.
long switches(const std::string& thread) {
  std::ifstream status("/proc/self/task/" + thread + "/status");
  for (std::string word; status >> word;) {
    if (word != "voluntary_ctxt_switches:") continue;
    long count = 0;
    status >> count;
    return count;
  }
  return -1;
}

TEST_P(EveryExecutor, SleepsWhileThereIsNothingToDo) {
  if (!is_ours(GetParam())) GTEST_SKIP() << "ours";
  std::atomic_long id{0};
  const auto subscription =
      node->create_subscription<Int32>("topic", 10, [&](Int32::ConstSharedPtr) { id = gettid(); });
  const auto publisher = node->create_publisher<Int32>("topic", 10);
  executor->add_node(node);
  const Spinning spinning(*executor);
  ASSERT_TRUE(eventually([&] {
    publisher->publish(Int32());
    return id != 0;
  }));
  std::this_thread::sleep_for(100ms);
  const long before = switches(std::to_string(id));
  ASSERT_GE(before, 0);
  std::this_thread::sleep_for(500ms);
  EXPECT_LE(switches(std::to_string(id)) - before, 1);
}

}  // namespace
}  // namespace hotpath::test
