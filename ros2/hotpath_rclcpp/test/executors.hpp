// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <rcutils/logging.h>

#include <rclcpp/version.h>
#include <rclcpp/rclcpp.hpp>
#if RCLCPP_VERSION_GTE(21, 0, 0)
#include <rclcpp/experimental/executors/events_executor/events_executor.hpp>
#endif
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hotpath_rclcpp/priority_executor.hpp"

namespace hotpath::test {

using namespace std::chrono_literals;

/// hotpath's executors, and rclcpp's own as a control: a failure of both is a defect of rclcpp.
inline std::vector<std::string> executor_names() {
  return {"rm-ro",     "rm-re", "dm-ro",   "edf-ro", "edf-re", "fp-ro", "fp-re", "events-ro",
          "events-re", "cbg",   "rm-ro:2", "cbg:2",  "single", "multi", "events"};
}

inline bool is_ours(const std::string& name) {
  return name != "single" && name != "multi" && name != "events";
}

/// `name`: `NAME` or `NAME:THREADS`. Null if this rclcpp version lacks the executor.
inline std::shared_ptr<rclcpp::Executor> make_executor(const std::string& name) {
  if (name == "single") return std::make_shared<rclcpp::executors::SingleThreadedExecutor>();
  if (name == "multi") return std::make_shared<rclcpp::executors::MultiThreadedExecutor>();
#if RCLCPP_VERSION_GTE(21, 0, 0)
  if (name == "events") return std::make_shared<rclcpp::experimental::executors::EventsExecutor>();
#endif
  if (name == "events") return nullptr;
  PriorityExecutorOptions options;
  const std::size_t colon = std::min(name.find(':'), name.size());
  options.executor = name.substr(0, colon);
  if (colon < name.size()) options.threads = static_cast<unsigned>(std::stoul(name.substr(colon + 1)));
  return std::make_shared<PriorityExecutor>(options);
}

/// Waits until `condition` holds, with a limit that suits a busy machine.
template <class Condition>
bool eventually(Condition condition) {
  const auto limit = std::chrono::steady_clock::now() + 10s;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > limit) return false;
    std::this_thread::sleep_for(1ms);
  }
  return true;
}

/// Spins in a separate thread until it is cancelled or goes out of scope.
class Spinning {
 public:
  explicit Spinning(rclcpp::Executor& executor)
      : executor_(executor), thread_([this] {
          executor_.spin();
          ended_ = true;
        }) {}
  ~Spinning() { stop(); }
  void stop() {
    // A cancel() before spin() has begun would have no effect.
    if (thread_.joinable()) eventually([&] { return executor_.is_spinning() || ended_; });
    executor_.cancel();
    if (thread_.joinable()) thread_.join();
  }

 private:
  rclcpp::Executor& executor_;
  std::atomic_bool ended_{false};
  std::thread thread_;
};

/// Captures log output, instead of printing it, during its lifetime.
class Logged {
 public:
  Logged() : before_(rcutils_logging_get_output_handler()) {
    lines_.clear();
    rcutils_logging_set_output_handler(keep);
  }
  ~Logged() { rcutils_logging_set_output_handler(before_); }
  Logged(const Logged&) = delete;
  Logged& operator=(const Logged&) = delete;
  [[nodiscard]] std::string text() const {
    std::string text;
    for (const auto& [severity, line] : all()) text += line;
    return text;
  }
  /// The lines of this severity that contain `part`.
  [[nodiscard]] std::vector<std::string> lines(int severity, const std::string& part = "") const {
    std::vector<std::string> found;
    for (const auto& [of, line] : all()) {
      if (of == severity && line.find(part) != std::string::npos) found.push_back(line);
    }
    return found;
  }

 private:
  using Lines = std::vector<std::pair<int, std::string>>;
  static Lines all() {
    const std::lock_guard lock(mutex_);
    return lines_;
  }
  static void keep(const rcutils_log_location_t*, int severity, const char*, rcutils_time_point_value_t,
                   const char* format, va_list* arguments) {
    char text[4000];
    vsnprintf(text, sizeof text, format, *arguments);
    const std::lock_guard lock(mutex_);
    lines_.emplace_back(severity, text);
  }

  const rcutils_logging_output_handler_t before_;
  inline static std::mutex mutex_;
  inline static Lines lines_;
};

/// One case per executor, each with its own context.
class EveryExecutor : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    rclcpp::init(0, nullptr);
    executor = make_executor(GetParam());
    if (!executor) GTEST_SKIP() << "this version of rclcpp has no such executor";
    node = std::make_shared<rclcpp::Node>("node");
  }
  void TearDown() override {
    node.reset();
    executor.reset();
    rclcpp::shutdown();
  }
  [[nodiscard]] PriorityExecutor& ours() const { return dynamic_cast<PriorityExecutor&>(*executor); }

  std::shared_ptr<rclcpp::Executor> executor;
  rclcpp::Node::SharedPtr node;
};

inline std::string case_name(const testing::TestParamInfo<std::string>& info) {
  std::string name = info.param;
  for (char& c : name) {
    if (c == '-' || c == ':') c = '_';
  }
  return name;
}

}  // namespace hotpath::test
