// SPDX-License-Identifier: Apache-2.0
#include "import/hypothesis.hpp"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "program/text.hpp"

namespace hotpath::imports {

namespace {

/// The major version of rcl of each release.
constexpr std::array<std::pair<int, RosDistro>, 5> kReleases = {{{5, RosDistro::humble},
                                                                 {6, RosDistro::iron},
                                                                 {9, RosDistro::jazzy},
                                                                 {10, RosDistro::kilted},
                                                                 {11, RosDistro::lyrical}}};

/// Whether the system can have an executor of these releases. A version between those of two
/// releases belongs to the development of the later one.
bool can_have(const std::string& rcl_version, const RosDistros& releases) {
  const int version = std::atoi(rcl_version.c_str());
  if (version < kReleases.front().first) return true;  // unknown
  const auto later = std::ranges::upper_bound(kReleases, version, {}, [](const auto& r) { return r.first; });
  const auto release = std::prev(later);
  return releases.has(release->second) ||
         (later != kReleases.end() && version > release->first && releases.has(later->second));
}

/// Whether an executor with these traits can have run the threads, each of which ran a job.
bool fits_threads(const ExecutorTraits& traits, const RecordedSteps& recorded) {
  const std::size_t threads = recorded.has_timers.size();
  if (traits.timers == TimerHandling::release_and_execute) {
    const auto timer_threads = std::ranges::count(recorded.has_timers, true);
    const auto others = std::ranges::count(recorded.has_others, true);
    return timer_threads <= 1 && others <= 1 && static_cast<std::size_t>(timer_threads + others) == threads;
  }
  if (threads == 1) return !traits.many_workers || traits.family != Family::wait_set;
  return traits.many_workers && threads <= most_threads(traits);
}

}  // namespace

bool emits_waits(const ExecutorTraits& traits) {
  return traits.family == Family::wait_set && traits.runs_first == TaskKind::timer;
}

std::vector<Hypothesis> possible_hypotheses(const RecordedSteps& recorded, bool waits,
                                            const std::string& rcl_version) {
  std::vector<Hypothesis> possible;
  for (const ExecutorEntry& entry : executors()) {
    const ExecutorTraits& traits = entry.traits;
    if (emits_waits(traits) != waits || !fits_threads(traits, recorded)) continue;
    if (traits.on_rclcpp && !can_have(rcl_version, *traits.on_rclcpp)) continue;
    Hypothesis plain{std::string(entry.name), &entry, {}, {}, {}};
    plain.order.resize(recorded.own.size());
    std::iota(plain.order.begin(), plain.order.end(), 0U);
    if (traits.many_workers) {
      plain.options.workers = static_cast<unsigned>(recorded.has_timers.size());
      plain.label = program::concat(plain.label, ":", plain.options.workers);
    }
    possible.push_back(plain);
    if (traits.family != Family::priority_events) continue;
    for (const auto& [rule, ties] :
         {std::pair(SubscriptionRule::first, Ties::lifo), std::pair(SubscriptionRule::inherit, Ties::fifo),
          std::pair(SubscriptionRule::first, Ties::fifo)}) {
      Hypothesis& variant = possible.emplace_back(plain);
      variant.options.rule = rule;
      variant.options.ties = ties;
      if (rule != plain.options.rule) variant.label += program::concat(":", to_string(rule));
      if (ties != plain.options.ties) variant.label += program::concat(":", to_string(ties));
    }
  }
  return possible;
}

}  // namespace hotpath::imports
