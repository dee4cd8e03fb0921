// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>

#include "hotpath/sensor/event_table.hpp"

namespace hotpath::tracing {

using sensor::EventField, sensor::EventFormat, sensor::EventKind, sensor::EventRole, sensor::FieldType;
using sensor::find_format, sensor::format_of, sensor::kEvents;

using Duration = std::chrono::nanoseconds;

/// An instant of the trace's clock.
using Time = std::chrono::time_point<std::chrono::steady_clock, Duration>;

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
