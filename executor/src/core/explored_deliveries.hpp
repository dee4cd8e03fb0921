// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "explored_state.hpp"

namespace hotpath {

/// The samples that are published at one instant of an exploration: some arrive at once, before their
/// publisher's thread goes on; the others at an instant that is a coordinate.
class ExploredDeliveries final : public Deliveries {
 public:
  /// Calls `happens`, in which samples are published, for each choice of those that arrive at once.
  template <class Happens>
  void for_each_choice(const Happens& happens) {
    at_once_.clear();
    do {
      sent_.clear();
      happens();
      while (!at_once_.empty() && at_once_.back()) at_once_.pop_back();
      if (!at_once_.empty()) at_once_.back() = true;
    } while (!at_once_.empty());
  }

  [[nodiscard]] Duration of(TaskId subscription, std::uint64_t number, Duration longest) const override {
    constexpr std::size_t kMost = 12;
    if (sent_.size() == kMost) {
      throw ExplorationRefused("more than 12 samples may be published at one instant",
                               ExplorationRefused::Why::stopped);
    }
    if (at_once_.size() == sent_.size()) at_once_.push_back(false);
    sent_.emplace_back(subscription, number);
    return at_once_[sent_.size() - 1] ? Duration{} : longest;
  }

  /// Gives the samples that were published now, and are on their way, a coordinate each for their arrival.
  void note(ExploredState& state, Duration longest) const {
    if (sent_.empty()) return;
    const std::deque<ExploredSimulation::Sample>& on_the_way = state.simulation->on_the_way();
    for (const auto& [subscription, number] : sent_) {
      state.sent.push_back({subscription, 0});
      for (const ExploredSimulation::Sample& sample : on_the_way) {
        if (sample.subscription != subscription || sample.number != number) continue;
        const std::size_t arrival = state.sent.back().arrival = state.track(arrival_of(sample));
        state.zone.assign(arrival, kNow, 1, longest.count());
        for (const ExploredSimulation::Sample& earlier : on_the_way) {
          if (!earlier.goes_before(sample)) continue;
          [[maybe_unused]] const bool any = state.zone.limit(state.start_of(arrival_of(earlier)), arrival, 0);
          assert(any && "a sample that overtakes another");
        }
      }
    }
  }

 private:
  // By subscription and number, in the order of publication; and whether each arrives at once.
  mutable std::vector<std::pair<TaskId, std::uint64_t>> sent_;
  mutable std::vector<bool> at_once_;
};

}  // namespace hotpath
