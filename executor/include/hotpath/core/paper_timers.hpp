// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <stdexcept>
#include <string>

#include "hotpath/core/task.hpp"

namespace hotpath {

/// The paper's timers-only task set (Section VII-A) with a utilisation of 60, 80 or 90 percent: two LiDARs,
/// four cameras and an IMU, in order of creation, with the names of graphs/timers_only_*.yaml. Throws
/// std::invalid_argument for any other utilisation.
[[nodiscard]] inline TaskSet paper_timers(int utilisation_percent) {
  using namespace std::chrono_literals;
  const std::map<int, Duration> camera_work = {{60, 10ms}, {80, 14ms}, {90, 16ms}};
  const auto camera = camera_work.find(utilisation_percent);
  if (camera == camera_work.end()) {
    throw std::invalid_argument("the paper has no timers-only task set with " +
                                std::to_string(utilisation_percent) + " % utilisation; use 60, 80 or 90");
  }
  TaskSet set;
  set.groups.clear();
  const auto add = [&](const char* name, Duration period, Duration work) {
    Task& task = set.tasks.emplace_back();
    task.name = name;
    task.period = task.deadline = period;
    task.wcet = task.bcet = work;
    task.group = set.size() - 1;
    set.groups.push_back(CallbackGroup::mutually_exclusive);
  };
  for (const char* name : {"FrontLidarDriver", "RearLidarDriver"}) add(name, 200ms, 10ms);
  for (const char* name : {"FrontCamera", "RearCamera", "LeftCamera", "RightCamera"})
    add(name, 84ms, camera->second);
  add("IMU", 30ms, 1ms);
  return set;
}

}  // namespace hotpath
