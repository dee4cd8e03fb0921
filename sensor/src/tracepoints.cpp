// SPDX-License-Identifier: Apache-2.0
// The tracepoints of tracetools 8 (ROS 2 Jazzy), in the order of its tracetools.h, and those of
// tracetools 4 (Humble), which have the same parameters except for rmw_publish. Tracepoints that are not
// recorded are not defined here, so that programs call tracetools directly.
#include <dlfcn.h>

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "thread_ring.hpp"

namespace {

using hotpath::sensor::EventKind;

/// The kind of an event of the table; fails to compile if it is none.
consteval EventKind kind_of(const char* name) { return hotpath::sensor::find_format(name)->kind; }

/// The function of the same name in tracetools.
template <class Function>
class Next {
 public:
  constexpr explicit Next(const char* symbol) : symbol_(symbol) {}

  /// nullptr: there is none.
  Function* get() {
    if (!looked_up_.load(std::memory_order_acquire)) look_up();
    return function_.load(std::memory_order_relaxed);
  }

 private:
  void look_up() {
    void* found = dlsym(RTLD_NEXT, symbol_);
    if (found == nullptr) {  // a library that is loaded for one module only, as Python does
      void* const library = dlopen("libtracetools.so", RTLD_LAZY | RTLD_NOLOAD);
      if (library != nullptr) found = dlsym(library, symbol_);
      if (library != nullptr) dlclose(library);
    }
    function_.store(reinterpret_cast<Function*>(found), std::memory_order_relaxed);
    looked_up_.store(true, std::memory_order_release);
  }

  const char* const symbol_;
  std::atomic<Function*> function_{nullptr};
  std::atomic<bool> looked_up_{false};
};

std::uint64_t number(const void* handle) { return reinterpret_cast<std::uintptr_t>(handle); }
std::uint64_t number(std::int64_t value) { return static_cast<std::uint64_t>(value); }

/// Whether tracetools is Humble's, whose rmw_publish has the message alone; it lacks the `do_` forms.
bool is_humble() {
  static constinit Next<void()> older("ros_trace_rmw_take"), newer("ros_trace_do_rmw_take");
  return newer.get() == nullptr && older.get() != nullptr;
}

}  // namespace

/// Defines the three functions of a tracepoint: the call, the question whether a call has an effect,
/// and the call after that question.
///
/// The call is passed on first. If LTTng records, it takes some microseconds until it reads its clock
/// when its code is not in the caches, as after a wait, but less than one from then on: the sensor's
/// instants agree with LTTng's only afterwards, and a callback does not seem to run meanwhile.
#define HOTPATH_TRACEPOINT(name, parameters, arguments, ...)                      \
  extern "C" [[gnu::visibility("default")]] bool ros_trace_enabled_##name() {     \
    static constinit Next<bool()> next("ros_trace_enabled_" #name);               \
    if (hotpath::sensor::active()) return true;                                   \
    auto* const enabled = next.get();                                             \
    return enabled != nullptr && enabled();                                       \
  }                                                                               \
  extern "C" [[gnu::visibility("default")]] void ros_trace_##name parameters {    \
    static constinit Next<void parameters> next("ros_trace_" #name);              \
    if (auto* const function = next.get()) function arguments;                    \
    hotpath::sensor::record(kind_of("ros2:" #name), __VA_ARGS__);                 \
  }                                                                               \
  extern "C" [[gnu::visibility("default")]] void ros_trace_do_##name parameters { \
    static constinit Next<void parameters> next("ros_trace_do_" #name);           \
    if (auto* const function = next.get()) function arguments;                    \
    hotpath::sensor::record(kind_of("ros2:" #name), __VA_ARGS__);                 \
  }

using Handle = const void*;
using Text = const char*;

HOTPATH_TRACEPOINT(rcl_init, (Handle context), (context), {number(context)})
HOTPATH_TRACEPOINT(rcl_node_init, (Handle node, Handle rmw, Text name, Text space), (node, rmw, name, space),
                   {number(node), number(rmw)}, {name, space})
HOTPATH_TRACEPOINT(rcl_publisher_init,
                   (Handle publisher, Handle node, Handle rmw, Text topic, std::size_t depth),
                   (publisher, node, rmw, topic, depth),
                   {number(publisher), number(node), number(rmw), depth}, {topic})
HOTPATH_TRACEPOINT(rclcpp_intra_publish, (Handle publisher, Handle message), (publisher, message),
                   {number(publisher), number(message)})
HOTPATH_TRACEPOINT(rcl_publish, (Handle publisher, Handle message), (publisher, message),
                   {number(publisher), number(message)})
HOTPATH_TRACEPOINT(rmw_publish, (Handle publisher, Handle message, std::int64_t timestamp),
                   (publisher, message, timestamp),
                   {is_humble() ? 0 : number(publisher), number(is_humble() ? publisher : message),
                    is_humble() ? 0 : number(timestamp)})
HOTPATH_TRACEPOINT(rcl_subscription_init,
                   (Handle subscription, Handle node, Handle rmw, Text topic, std::size_t depth),
                   (subscription, node, rmw, topic, depth),
                   {number(subscription), number(node), number(rmw), depth}, {topic})
HOTPATH_TRACEPOINT(rclcpp_subscription_init, (Handle subscription, Handle rclcpp), (subscription, rclcpp),
                   {number(subscription), number(rclcpp)})
HOTPATH_TRACEPOINT(rclcpp_subscription_callback_added, (Handle rclcpp, Handle callback), (rclcpp, callback),
                   {number(rclcpp), number(callback)})
HOTPATH_TRACEPOINT(rmw_take, (Handle subscription, Handle message, std::int64_t timestamp, bool taken),
                   (subscription, message, timestamp, taken),
                   {number(subscription), number(message), number(timestamp), taken})
HOTPATH_TRACEPOINT(rcl_service_init, (Handle service, Handle node, Handle rmw, Text name),
                   (service, node, rmw, name), {number(service), number(node)}, {name})
HOTPATH_TRACEPOINT(rclcpp_service_callback_added, (Handle service, Handle callback), (service, callback),
                   {number(service), number(callback)})
HOTPATH_TRACEPOINT(rcl_timer_init, (Handle timer, std::int64_t period), (timer, period),
                   {number(timer), number(period)})
HOTPATH_TRACEPOINT(rclcpp_timer_callback_added, (Handle timer, Handle callback), (timer, callback),
                   {number(timer), number(callback)})
HOTPATH_TRACEPOINT(rclcpp_timer_link_node, (Handle timer, Handle node), (timer, node),
                   {number(timer), number(node)})
HOTPATH_TRACEPOINT(callback_start, (Handle callback, bool intra_process), (callback, intra_process),
                   {number(callback), intra_process})
HOTPATH_TRACEPOINT(callback_end, (Handle callback), (callback), {number(callback)})
HOTPATH_TRACEPOINT(rclcpp_executor_wait_for_work, (std::int64_t timeout), (timeout), {number(timeout)})
HOTPATH_TRACEPOINT(rclcpp_ipb_to_subscription, (Handle ipb, Handle subscription), (ipb, subscription),
                   {number(ipb), number(subscription)})
HOTPATH_TRACEPOINT(rclcpp_buffer_to_ipb, (Handle buffer, Handle ipb), (buffer, ipb),
                   {number(buffer), number(ipb)})
HOTPATH_TRACEPOINT(rclcpp_ring_buffer_enqueue,
                   (Handle buffer, std::uint64_t index, std::uint64_t size, bool overwritten),
                   (buffer, index, size, overwritten), {number(buffer), index})
HOTPATH_TRACEPOINT(rclcpp_ring_buffer_dequeue, (Handle buffer, std::uint64_t index, std::uint64_t size),
                   (buffer, index, size), {number(buffer), index})

/// hotpath's own executors state the nominal instant and the release of the thread's next job.
extern "C" [[gnu::visibility("default")]] void hotpath_watch_executor(Handle executor, Text name) {
  hotpath::sensor::record(EventKind::executor_init, {number(executor)}, {name});
}
extern "C" [[gnu::visibility("default")]] void hotpath_watch_job(Handle executor, std::uint64_t task,
                                                                 std::int64_t timestamp,
                                                                 std::int64_t release) {
  hotpath::sensor::record(EventKind::executor_job,
                          {number(executor), task, number(timestamp), number(release)});
}
