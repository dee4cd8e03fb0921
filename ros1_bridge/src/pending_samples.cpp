// SPDX-License-Identifier: Apache-2.0
#include "pending_samples.hpp"

#include <utility>

namespace hotpath {

void PendingSamples::keep(Event event, Time arrived) {
  constexpr std::size_t kMost = 1024, kMostBytes = 64 << 20;
  bytes_ += bytes_of(event);
  samples_.push_back({std::move(event), arrived});
  while (samples_.size() > kMost || bytes_ > kMostBytes) forget_oldest();
}

void PendingSamples::forget(Time arrived_before) {
  while (!samples_.empty() && samples_.front().arrived < arrived_before) forget_oldest();
}

std::vector<Event> PendingSamples::take(std::string_view run) {
  std::vector<Event> taken;
  std::deque<Sample> others;
  for (Sample& sample : samples_) {
    if (run_of(sample.event) != run) {
      others.push_back(std::move(sample));
      continue;
    }
    bytes_ -= bytes_of(sample.event);
    taken.push_back(std::move(sample.event));
  }
  samples_ = std::move(others);
  return taken;
}

void PendingSamples::forget_oldest() {
  bytes_ -= bytes_of(samples_.front().event);
  samples_.pop_front();
  ++forgotten_;
}

}  // namespace hotpath
