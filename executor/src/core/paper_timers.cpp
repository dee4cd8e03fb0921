// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/paper_timers.hpp"

#include <algorithm>
#include <stdexcept>

namespace hotpath {

TaskSet paper_timers(int utilisation_percent) {
  using std::chrono::milliseconds;
  constexpr std::array kCameraWork = {milliseconds(10), milliseconds(14), milliseconds(16)};
  const auto place = std::find(kPaperUtilisations.begin(), kPaperUtilisations.end(), utilisation_percent);
  if (place == kPaperUtilisations.end()) {
    throw std::invalid_argument("the paper has no timers-only task set with " +
                                std::to_string(utilisation_percent) + " % utilisation; use 60, 80 or 90");
  }
  const milliseconds camera = kCameraWork[static_cast<std::size_t>(place - kPaperUtilisations.begin())];
  TaskSet set;
  set.groups.clear();
  const auto add = [&](const char* name, milliseconds period, milliseconds work) {
    Task& task = set.tasks.emplace_back();
    task.name = name;
    task.period = task.deadline = period;
    task.wcet = task.bcet = work;
    task.group = set.size() - 1;
    set.groups.push_back(CallbackGroup::mutually_exclusive);
  };
  for (const char* name : {"FrontLidarDriver", "RearLidarDriver"})
    add(name, milliseconds(200), milliseconds(10));
  for (const char* name : {"FrontCamera", "RearCamera", "LeftCamera", "RightCamera"}) {
    add(name, milliseconds(84), camera);
  }
  add("IMU", milliseconds(30), milliseconds(1));
  return set;
}

}  // namespace hotpath
