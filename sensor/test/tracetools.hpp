// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

// The tracepoints that the traced program of the tests calls, as tracetools 8 declares them.
extern "C" {
void ros_trace_rcl_node_init(const void* node, const void* rmw, const char* name, const char* space);
void ros_trace_rcl_publisher_init(const void* publisher, const void* node, const void* rmw, const char* topic,
                                  std::size_t depth);
void ros_trace_callback_start(const void* callback, bool intra_process);
void ros_trace_callback_end(const void* callback);
bool ros_trace_enabled_rmw_take();
void ros_trace_do_rmw_take(const void* subscription, const void* message, std::int64_t timestamp, bool taken);
/// Calls of the stand-in so far; the real library does not have it.
[[gnu::weak]] std::uint64_t stand_in_calls();
}
