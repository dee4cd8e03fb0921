// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// The events of ros2_tracing (provider `ros2`, versions 2 to 8) that an import reads, and CARET's
/// event with the source timestamps that older versions lack.
enum class TraceEventKind : std::uint8_t {
  rcl_init,
  node_init,
  publisher_init,
  subscription_init,
  rclcpp_subscription_init,
  subscription_callback_added,
  timer_init,
  timer_callback_added,
  timer_link_node,
  service_callback_added,
  callback_start,
  callback_end,
  rcl_publish,
  rmw_publish,
  intra_publish,
  rmw_take,
  dispatch_subscription_callback,
  bind_stamp,
  buffer_to_ipb,
  ipb_to_subscription,
  ring_buffer_enqueue,
  ring_buffer_dequeue,
  wait_for_work,
  other,  ///< Only counted.
};

/// The name of an event and the fields to read, in the order of TraceEvent::number and
/// TraceEvent::text. A field that a trace lacks is 0 or empty.
struct TraceEventFormat {
  std::string_view name;
  TraceEventKind kind;
  std::array<std::string_view, 4> numbers;
  std::array<std::string_view, 2> texts = {};
};
[[nodiscard]] std::span<const TraceEventFormat> trace_event_formats();

/// One event of a trace; views are valid while it is visited.
struct TraceEvent {
  TraceEventKind kind = TraceEventKind::other;
  std::int64_t at_ns = 0;  ///< Since the origin of the trace's clock.
  std::uint32_t process = 0, thread = 0;
  std::int32_t processor = -1;  ///< -1: unknown.
  std::array<std::uint64_t, 4> number = {};
  std::array<std::string_view, 2> text = {};
};

/// Receives the events of a trace in the order of time.
class TraceVisitor {
 public:
  virtual ~TraceVisitor() = default;
  virtual void visit(const TraceEvent& event) = 0;
};

/// Facts about a trace beside its events.
struct TraceReading {
  std::map<std::string, std::uint64_t> events;  ///< By full name, `ros2:callback_start`.
  std::uint64_t all_events = 0;
  std::uint64_t discarded_events = 0;   ///< Least number of events for which the tracer had no room.
  std::uint64_t discarded_packets = 0;  ///< Groups of events that were overwritten.
  std::string broken_off;               ///< Why reading stopped before the end; empty: it did not.
  std::int64_t first_ns = 0, last_ns = 0;
  std::int64_t longest_gap_ns = 0, gap_begin_ns = 0;  ///< Longest time without any event, and when it began.
};

}  // namespace hotpath
