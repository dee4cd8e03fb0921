// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>

namespace hotpath {

/// Nanoseconds, signed. All arithmetic inside hotpath is exact integer arithmetic in this unit.
using Duration = std::chrono::nanoseconds;

/// An instant of CLOCK_MONOTONIC in a live run; nanoseconds since the epoch of the run in a simulated one.
using Time = std::chrono::time_point<std::chrono::steady_clock, Duration>;

inline constexpr Time kNever = Time::max();

constexpr double to_ms(Duration d) { return static_cast<double>(d.count()) / 1e6; }

constexpr double to_s(Duration d) { return to_ms(d) / 1000; }

constexpr double to_us(Duration d) { return static_cast<double>(d.count()) / 1e3; }

/// `ms` milliseconds, rounded to the nearest nanosecond.
constexpr Duration from_ms(double ms) {
  return Duration(static_cast<std::int64_t>(ms * 1e6 + (ms < 0 ? -0.5 : 0.5)));
}

constexpr Duration from_s(double s) { return from_ms(s * 1000); }

constexpr std::int64_t to_ns(Time t) { return t.time_since_epoch().count(); }
constexpr Time from_ns(std::int64_t ns) { return Time(Duration(ns)); }

}  // namespace hotpath
