// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

namespace hotpath::tracing {

using Duration = std::chrono::nanoseconds;

/// An instant of the trace's clock.
using Time = std::chrono::time_point<std::chrono::steady_clock, Duration>;

/// Events of ros2_tracing (provider `ros2`, versions 2 to 8), and CARET's event with the source
/// timestamps that older versions lack. The last ones are hotpath's own (provider `hotpath`): those of
/// its executors, and a mark of the watcher. In the order of formats().
enum class EventKind : std::uint8_t {
  rcl_init,
  node_init,
  publisher_init,
  subscription_init,
  rmw_publisher_init,
  rmw_subscription_init,
  service_init,
  client_init,
  rclcpp_subscription_init,
  subscription_callback_added,
  callback_register,
  timer_init,
  timer_callback_added,
  timer_link_node,
  service_callback_added,
  callback_start,
  callback_end,
  rclcpp_publish,
  rcl_publish,
  rmw_publish,
  intra_publish,
  rmw_take,
  rcl_take,
  rclcpp_take,
  dispatch_subscription_callback,
  bind_stamp,
  buffer_to_ipb,
  ipb_to_subscription,
  ring_buffer_enqueue,
  ring_buffer_dequeue,
  get_next_ready,
  wait_for_work,
  execute,
  executor_init,
  executor_callback,
  executor_priority,
  executor_job,
  executor_end,
  incident,
};

/// A `gid` is sixteen bytes, which count as two numbers: eight bytes each, the first one highest. An
/// `instant` is a reading of the trace's clock in ns; readers convert it like the time of the event.
enum class FieldType : std::uint8_t { address, integer, text, gid, instant };

/// The name of an event and its fields. A trace may order them differently, and have more or fewer.
struct EventFormat {
  struct Field {
    const char* name;
    FieldType type;
  };
  EventKind kind;
  const char* name;
  std::vector<Field> fields;  ///< At most four addresses and integers, a gid counting twice, and two texts.
  bool assembled = true;      ///< False: only written; readers skip it.
};

/// All formats, by kind.
[[nodiscard]] std::span<const EventFormat> formats();

/// One event.
struct Event {
  EventKind kind = EventKind::rcl_init;
  std::uint32_t process = 0, thread = 0;
  std::int32_t processor = -1;  ///< -1: unknown.
  Time at{};
  /// The values of the format's addresses and integers, in its order; 0: the trace lacks the field.
  std::array<std::uint64_t, 4> number = {};
  std::array<const char*, 2> text = {"", ""};  ///< The same for texts; valid while the event is visited.
};

}  // namespace hotpath::tracing
