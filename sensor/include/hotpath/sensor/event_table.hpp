// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

/// The one table of events, for the sensor, readers and writers of traces, and their assembly. A new
/// event needs its row and a handler in tracing::Assembler.
namespace hotpath::sensor {

/// Kind, origin, role, name and fields of each event, which one row adds.
#define HOTPATH_EVENTS(EVENT)                                                                                \
  EVENT(rcl_init, humble, describes, "ros2:rcl_init", "context_handle", text("version"))                     \
  EVENT(node_init, humble, describes, "ros2:rcl_node_init", "node_handle", "rmw_handle", text("node_name"),  \
        text("namespace"))                                                                                   \
  EVENT(publisher_init, humble, describes, "ros2:rcl_publisher_init", "publisher_handle", "node_handle",     \
        "rmw_publisher_handle", text("topic_name"), "queue_depth")                                           \
  EVENT(subscription_init, humble, describes, "ros2:rcl_subscription_init", "subscription_handle",           \
        "node_handle", "rmw_subscription_handle", text("topic_name"), "queue_depth")                         \
  EVENT(rmw_publisher_init, humble, describes, "ros2:rmw_publisher_init", "rmw_publisher_handle",            \
        gid("gid"))                                                                                          \
  EVENT(rmw_subscription_init, humble, describes, "ros2:rmw_subscription_init", "rmw_subscription_handle",   \
        gid("gid"))                                                                                          \
  EVENT(service_init, humble, describes, "ros2:rcl_service_init", "service_handle", "node_handle",           \
        text("service_name"))                                                                                \
  EVENT(client_init, humble, describes, "ros2:rcl_client_init", "client_handle", "node_handle",              \
        text("service_name"))                                                                                \
  EVENT(rclcpp_subscription_init, humble, describes, "ros2:rclcpp_subscription_init", "subscription_handle", \
        "subscription")                                                                                      \
  EVENT(subscription_callback_added, humble, describes, "ros2:rclcpp_subscription_callback_added",           \
        "subscription", "callback")                                                                          \
  EVENT(callback_register, humble, describes, "ros2:rclcpp_callback_register", "callback", text("symbol"))   \
  EVENT(timer_init, humble, describes, "ros2:rcl_timer_init", "timer_handle", integer("period"))             \
  EVENT(timer_callback_added, humble, describes, "ros2:rclcpp_timer_callback_added", "timer_handle",         \
        "callback")                                                                                          \
  EVENT(timer_link_node, humble, describes, "ros2:rclcpp_timer_link_node", "timer_handle", "node_handle")    \
  EVENT(service_callback_added, humble, describes, "ros2:rclcpp_service_callback_added", "service_handle",   \
        "callback")                                                                                          \
  EVENT(callback_start, humble, happens, "ros2:callback_start", "callback", integer("is_intra_process"))     \
  EVENT(callback_end, humble, happens, "ros2:callback_end", "callback")                                      \
  EVENT(rclcpp_publish, humble, only_kept, "ros2:rclcpp_publish", "message")                                 \
  EVENT(rcl_publish, humble, happens, "ros2:rcl_publish", "publisher_handle", "message")                     \
  EVENT(rmw_publish, humble, happens, "ros2:rmw_publish", "rmw_publisher_handle", "message",                 \
        integer("timestamp"))                                                                                \
  EVENT(intra_publish, iron, happens, "ros2:rclcpp_intra_publish", "publisher_handle", "message")            \
  EVENT(rmw_take, humble, happens, "ros2:rmw_take", "rmw_subscription_handle", "message",                    \
        integer("source_timestamp"), integer("taken"))                                                       \
  EVENT(rcl_take, humble, only_kept, "ros2:rcl_take", "message")                                             \
  EVENT(rclcpp_take, humble, only_kept, "ros2:rclcpp_take", "message")                                       \
  EVENT(dispatch_subscription_callback, galactic, happens, "ros2:dispatch_subscription_callback",            \
        "callback", integer("source_stamp"))                                                                 \
  EVENT(bind_stamp, caret, happens, "ros2_caret:dds_bind_addr_to_stamp", "addr", integer("source_stamp"))    \
  EVENT(buffer_to_ipb, iron, describes, "ros2:rclcpp_buffer_to_ipb", "buffer", "ipb")                        \
  EVENT(ipb_to_subscription, iron, describes, "ros2:rclcpp_ipb_to_subscription", "ipb", "subscription")      \
  EVENT(ring_buffer_enqueue, iron, happens, "ros2:rclcpp_ring_buffer_enqueue", "buffer", "index")            \
  EVENT(ring_buffer_dequeue, iron, happens, "ros2:rclcpp_ring_buffer_dequeue", "buffer", "index")            \
  EVENT(get_next_ready, humble, happens, "ros2:rclcpp_executor_get_next_ready")                              \
  EVENT(wait_for_work, humble, happens, "ros2:rclcpp_executor_wait_for_work", integer("timeout"))            \
  EVENT(execute, humble, happens, "ros2:rclcpp_executor_execute", "handle")                                  \
  EVENT(executor_init, hotpath, describes, "hotpath:executor_init", "executor", text("name"),                \
        text("priorities"))                                                                                  \
  EVENT(executor_callback, hotpath, describes, "hotpath:executor_callback", "executor", integer("task"),     \
        text("kind"), "handle", text("node"))                                                                \
  EVENT(executor_priority, hotpath, describes, "hotpath:executor_priority", "executor", integer("task"),     \
        integer("level"))                                                                                    \
  EVENT(executor_job, hotpath, happens, "hotpath:executor_job", "executor", integer("task"),                 \
        instant("timestamp"), instant("release"))                                                            \
  EVENT(executor_end, hotpath, happens, "hotpath:executor_end", "executor", integer("task"))                 \
  EVENT(incident, hotpath, only_kept, "hotpath:incident", text("sentence"))

#define HOTPATH_KIND(kind, ...) kind,
enum class EventKind : std::uint8_t { HOTPATH_EVENTS(HOTPATH_KIND) };
#undef HOTPATH_KIND

enum class EventRole : std::uint8_t {
  describes,  ///< A node, publisher, callback or executor.
  happens,    ///< Of a job or its thread.
  only_kept,  ///< Other programs read it; the assembly does not.
};

/// The first release of ROS 2 that emits it, or another origin: CARET (the source timestamps that older
/// releases lack), or hotpath's executors and watcher.
enum class EventOrigin : std::uint8_t { galactic, humble, iron, caret, hotpath };

/// A `gid` is sixteen bytes, which count as two numbers: eight bytes each, the first one highest. An
/// `instant` is a reading of the trace's clock in ns; readers convert it like the time of the event.
enum class FieldType : std::uint8_t { address, integer, text, gid, instant };

struct EventField {
  // NOLINTNEXTLINE(google-explicit-constructor): the names of addresses stand alone in the table
  constexpr EventField(const char* named = nullptr, FieldType of = FieldType::address)
      : name(named), type(of) {}
  const char* name;
  FieldType type;
};

/// An event of ros2_tracing (provider `ros2`, versions 2 to 8), CARET or hotpath. A trace may order the
/// fields differently, and have more or fewer.
struct EventFormat {
  EventKind kind;
  EventOrigin origin;
  EventRole role;
  const char* name;  ///< `PROVIDER:EVENT`.
  /// At most four addresses and integers, a gid counting twice, and two texts.
  std::array<EventField, 5> all;
  std::size_t used;

  [[nodiscard]] constexpr std::span<const EventField> fields() const { return {all.data(), used}; }
};

/// All events, by kind.
inline constexpr auto kEvents = [] {
  using enum EventOrigin;
  using enum EventRole;
  constexpr auto integer = [](const char* name) { return EventField{name, FieldType::integer}; };
  constexpr auto text = [](const char* name) { return EventField{name, FieldType::text}; };
  constexpr auto gid = [](const char* name) { return EventField{name, FieldType::gid}; };
  constexpr auto instant = [](const char* name) { return EventField{name, FieldType::instant}; };
  constexpr auto row = [](EventKind kind, EventOrigin origin, EventRole role, const char* name,
                          auto... fields) {
    return EventFormat{kind, origin, role, name, {EventField(fields)...}, sizeof...(fields)};
  };
#define HOTPATH_ROW(kind, ...) row(EventKind::kind, __VA_ARGS__),
  return std::array{HOTPATH_EVENTS(HOTPATH_ROW)};
#undef HOTPATH_ROW
}();

[[nodiscard]] constexpr const EventFormat& format_of(EventKind kind) {
  return kEvents[static_cast<std::size_t>(kind)];
}

/// nullptr: there is no event of this name.
[[nodiscard]] constexpr const EventFormat* find_format(std::string_view name) {
  for (const EventFormat& format : kEvents)
    if (name == format.name) return &format;
  return nullptr;
}

}  // namespace hotpath::sensor
