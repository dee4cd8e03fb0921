// SPDX-License-Identifier: Apache-2.0
// An executor's effects on its process: threads, wake-ups, and its check of the loaded libraries.
#include <dlfcn.h>
#include <sched.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <ctime>
#include <fstream>
#include <optional>
#include <std_msgs/msg/int32.hpp>

#include "executors.hpp"

namespace hotpath::test {
namespace {

using std_msgs::msg::Int32;

INSTANTIATE_TEST_SUITE_P(Executors, EveryExecutor, testing::ValuesIn(executor_names()), case_name);

TEST(TwoFastDds, InOneProcessAreReported) {
  if (std::string(rmw_get_implementation_identifier()) != "rmw_fastrtps_cpp")
    GTEST_SKIP() << "the middleware is not Fast DDS";
  const auto made = [] {
    const Logged logged;
    const PriorityExecutor executor;
    return logged.text();
  };
  rclcpp::init(0, nullptr);
  EXPECT_EQ(made(), "");
  void* const second = dlopen(HOTPATH_NO_FASTDDS, RTLD_NOW);
  ASSERT_TRUE(second) << dlerror();
  EXPECT_NE(made().find("Two versions of Fast DDS are loaded, "), std::string::npos);
  dlclose(second);
  rclcpp::shutdown();
}

/// Pins this thread, and the threads that it starts, to one CPU during its lifetime.
class OneProcessor {
 public:
  OneProcessor() {
    sched_getaffinity(0, sizeof before_, &before_);
    cpu_set_t one;
    CPU_ZERO(&one);
    for (int cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++cpu) {
      if (CPU_ISSET(cpu, &before_)) CPU_SET(cpu, &one);
    }
    sched_setaffinity(0, sizeof one, &one);
  }
  ~OneProcessor() { sched_setaffinity(0, sizeof before_, &before_); }
  OneProcessor(const OneProcessor&) = delete;
  OneProcessor& operator=(const OneProcessor&) = delete;

 private:
  cpu_set_t before_{};
};

TEST(APolicyThatIsRefused, IsAnErrorBeforeAnyCallbackRuns) {
  long granted = -1;
  std::ifstream("/proc/sys/kernel/sched_rt_runtime_us") >> granted;
  if (granted < 0) GTEST_SKIP() << "this kernel does not limit real-time threads";
  rclcpp::init(0, nullptr);
  {
    const auto node = std::make_shared<rclcpp::Node>("node");
    int ran = 0;
    const auto timer = node->create_wall_timer(1ms, [&] { ++ran; });
    PriorityExecutorOptions options;
    // More than Linux grants on one CPU. With several CPUs, Linux denies SCHED_DEADLINE to a thread
    // that is not allowed on all of them.
    options.timer_thread = "deadline:1000/1000/1000";
    const OneProcessor pinned;
    PriorityExecutor executor(options);
    executor.add_node(node);
    ASSERT_TRUE(eventually([&] { return timer->is_ready(); }));
    EXPECT_THROW(executor.spin(), std::runtime_error);
    EXPECT_EQ(ran, 0);
    EXPECT_FALSE(executor.is_spinning());
  }
  rclcpp::shutdown();
}

TEST_P(EveryExecutor, SaysWhatItsThreadsObtained) {
  if (!is_ours(GetParam())) GTEST_SKIP() << "only for hotpath's executors";
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

/// The time limit of the futex call in which a thread of this process sleeps, on CLOCK_MONOTONIC;
/// the latest instant without a limit. std::nullopt: it does not sleep so, or just woke.
std::optional<std::chrono::nanoseconds> sleeps_until(const std::string& thread) {
  std::ifstream file("/proc/self/task/" + thread + "/syscall");
  long call = -1;
  std::uintptr_t word = 0, operation = 0, value = 0, limit = 0;
  if (!(file >> call >> std::hex >> word >> operation >> value >> limit) || call != SYS_futex) return {};
  if (limit == 0) return std::chrono::nanoseconds::max();
  timespec until{};
  const iovec own{&until, sizeof until}, of_thread{reinterpret_cast<void*>(limit), sizeof until};
  // Read like another process's memory: the thread may wake meanwhile and reuse its stack.
  if (process_vm_readv(getpid(), &own, 1, &of_thread, 1, 0) != sizeof until) return {};
  return std::chrono::seconds(until.tv_sec) + std::chrono::nanoseconds(until.tv_nsec);
}

TEST_P(EveryExecutor, SleepsWhileThereIsNothingToDo) {
  if (!is_ours(GetParam())) GTEST_SKIP() << "only for hotpath's executors";
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
  // The order of callbacks settles two seconds after the last one was learnt: the thread may wake for it.
  const auto late = std::chrono::steady_clock::now().time_since_epoch() + 1s;
  const std::string thread = std::to_string(id);
  if (!std::ifstream("/proc/self/task/" + thread + "/syscall").is_open()) {
    GTEST_SKIP() << "this kernel does not show the system call of a thread";
  }
  EXPECT_TRUE(eventually([&] {
    const auto until = sleeps_until(thread);
    return until && *until > late;
  }));
}

}  // namespace
}  // namespace hotpath::test
