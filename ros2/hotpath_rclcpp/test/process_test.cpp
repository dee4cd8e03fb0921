// SPDX-License-Identifier: Apache-2.0
// An executor's effects on its process: threads, wake-ups, and its check of the loaded libraries.
#include <dlfcn.h>
#include <sched.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <optional>
#include <std_msgs/msg/int32.hpp>
#include <thread>
#include <vector>

#include "executors.hpp"
#include "middleware_threads.hpp"

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
  const bool waits_itself = GetParam().ends_with("-ro");
  const std::size_t threads = waits_itself ? 1 : GetParam().find(":2") == std::string::npos ? 2 : 3;
  EXPECT_EQ(policies.size(), threads);
  EXPECT_EQ(policies.front().rfind("executor ", 0), 0U) << policies.front();
  EXPECT_EQ(policies.back().rfind("timer_mgmt ", 0) == 0, !waits_itself) << policies.back();
}

TEST(ATimerThread, IsMadeIfItsPolicyIsGiven) {
  rclcpp::init(0, nullptr);
  {
    PriorityExecutorOptions options;
    options.timer_thread = "batch";  // needs no permission
    PriorityExecutor executor(options);
    const Spinning spinning(executor);
    ASSERT_TRUE(eventually([&] { return !executor.thread_policies().empty(); }));
    EXPECT_EQ(executor.thread_policies().back(), "timer_mgmt batch");
  }
  rclcpp::shutdown();
}

/// The thread makes up for the releases during a callback, each at its instant.
TEST_P(EveryExecutor, ReleasesTheTimersThatWereDueDuringACallback) {
  if (!is_ours(GetParam()) || !GetParam().ends_with("-ro")) GTEST_SKIP() << "it has a timer thread";
  std::vector<RunningCallback> ran;
  std::vector<std::chrono::nanoseconds> begun;
  const auto timer = node->create_wall_timer(5ms, [&] {
    begun.push_back(std::chrono::steady_clock::now().time_since_epoch());
    ran.push_back(*PriorityExecutor::running_callback());
    if (ran.size() == 1) std::this_thread::sleep_for(52ms);
    if (ran.size() == 11) executor->cancel();
  });
  executor->add_node(node);
  executor->spin();
  ASSERT_GE(ran.size(), 11U);
  for (std::size_t i = 1; i < 11; ++i) {  // 10 instants passed during the first callback
    EXPECT_EQ(ran[i].sequence, ran[0].sequence + i);
    EXPECT_EQ(ran[i].timestamp, ran[0].timestamp + i * 5ms);
    EXPECT_EQ(ran[i].release, ran[i].timestamp);
    EXPECT_LT(ran[i].release, begun[i]);
  }
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

TEST(TheMiddleware, IsKnownByTheNamesOfItsThreads) {
  for (const char* own :
       {"dds.udp.7411", "dds.shm.23411", "dds.ev.0", "recvMC", "recvUC", "dq.builtins", "tev"})
    EXPECT_TRUE(is_of_middleware(own)) << own;
  for (const char* other : {"dds.shm.wdog", "hotpath_timers", "process_test", "gc"})
    EXPECT_FALSE(is_of_middleware(other)) << other;
}

TEST(TheMiddleware, TakesAPolicy) {
  rclcpp::init(0, nullptr);
  {
    const auto node = std::make_shared<rclcpp::Node>("node");
    PriorityExecutorOptions options;
    options.middleware_threads = "batch";  // needs no permission
    PriorityExecutor executor(options);
    executor.add_node(node);
    const auto policies = [] {
      std::vector<int> found;
      for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
        std::string name;
        std::getline(std::ifstream(task.path() / "comm") >> std::ws, name);
        if (is_of_middleware(name)) found.push_back(sched_getscheduler(std::stoi(task.path().filename())));
      }
      return found;
    };
    if (policies().empty()) GTEST_SKIP() << "this middleware does not name its threads";
    EXPECT_EQ(std::ranges::count(policies(), SCHED_BATCH), 0);
    const Spinning spinning(executor);
    EXPECT_TRUE(eventually([&] { return !executor.thread_policies().empty(); }));
    EXPECT_EQ(std::ranges::count(policies(), SCHED_OTHER), 0);
    EXPECT_NE(executor.thread_policies().front(), "executor batch");
  }
  rclcpp::shutdown();
}

}  // namespace
}  // namespace hotpath::test
