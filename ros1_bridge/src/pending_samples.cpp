// SPDX-License-Identifier: Apache-2.0
#include "pending_samples.hpp"

namespace hotpath {

void PendingSamples::keep(Event event, Time arrived) {
  constexpr std::size_t kMost = 1024, kMostBytes = 64 << 20;
  bytes_ += bytes_of(event);
  samples_.emplace_back(arrived, std::move(event));
  while (samples_.size() > kMost || bytes_ > kMostBytes) forget_oldest();
}

void PendingSamples::forget(Time arrived_before) {
  while (!samples_.empty() && samples_.front().first < arrived_before) forget_oldest();
}

std::vector<Event> PendingSamples::take(const std::string& run) {
  std::vector<Event> taken;
  std::deque<std::pair<Time, Event>> others;
  for (auto& sample : samples_) {
    if (run_of(sample.second) == run) {
      bytes_ -= bytes_of(sample.second);
      taken.push_back(std::move(sample.second));
    } else {
      others.push_back(std::move(sample));
    }
  }
  samples_ = std::move(others);
  return taken;
}

void PendingSamples::forget_oldest() {
  bytes_ -= bytes_of(samples_.front().second);
  samples_.pop_front();
  ++forgotten_;
}

}  // namespace hotpath
