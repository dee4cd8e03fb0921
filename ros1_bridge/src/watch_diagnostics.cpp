// SPDX-License-Identifier: Apache-2.0
#include "watch_diagnostics.hpp"

#include <chrono>

#include "outputs.hpp"
#include "ros_publisher.hpp"
#include "watch_relay.hpp"

namespace hotpath {

namespace {

Diagnoses to_diagnoses(const std::vector<WatchStatus>& statuses) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  Diagnoses diagnoses{std::chrono::duration_cast<std::chrono::nanoseconds>(now).count(), {}};
  for (const WatchStatus& status : statuses) {
    diagnoses.all.push_back(
        {static_cast<Diagnosis::Level>(status.level), status.name, status.message, "", status.values});
  }
  return diagnoses;
}

}  // namespace

void publish_watch(int descriptor, const std::function<bool()>& goes_on) {
  const RosPublisher<Diagnoses> diagnostics("/diagnostics", {});
  relay_watch(descriptor, goes_on,
              [&](const std::vector<WatchStatus>& statuses) { diagnostics.publish(to_diagnoses(statuses)); });
}

}  // namespace hotpath
