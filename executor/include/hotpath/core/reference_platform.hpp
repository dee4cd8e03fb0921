// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "hotpath/core/platform.hpp"

namespace hotpath {

/// What the real ROS 2 stack's executors cost on the reference machine (results/ros2_reference): in the
/// golden traces, medians from the end of a job to the start of the next that was already due (dispatch), and
/// from a timer's instant to the start of its job when nothing ran (wake-up). `multi` has no golden trace:
/// its dispatch cost is the hot path without work, 0.966 ms, over its seven callbacks. The reference machine
/// raised the timer thread of every release-only executor.
inline Platform reference_platform(std::string_view executor) {
  using namespace std::chrono_literals;
  Platform p;
  if (executor == "default") {
    p.dispatch_cost = 20us;
    p.wake_up_latency = 190us;
  } else if (executor == "multi") {
    p.cores = 2;
    p.dispatch_cost = 138us;
    p.wake_up_latency = 190us;
  } else if (executor == "static") {
    p.dispatch_cost = 7us;
    p.wake_up_latency = 180us;
  } else if (executor == "events-re") {
    p.dispatch_cost = 6us;
    p.wake_up_latency = 110us;
  } else {
    p.dispatch_cost = 1us;
    p.wake_up_latency = 70us;
  }
  return p;
}

}  // namespace hotpath
