// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "import/recorded_graph.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

/// Fewer irregular samples are taken for single events that do not recur.
constexpr std::size_t kFewestRecurring = 10;
/// The most timers for one topic.
constexpr std::size_t kMostTimers = 100;
/// Samples are regular if their distances differ from the mean by less than this share.
constexpr double kRegular = 0.1;
/// Period of a timer that fires once.
constexpr Duration kOnce = std::chrono::hours(1);

bool is_regular(const std::vector<Time>& at, Duration mean) {
  if (at.size() < 3) return false;
  const auto differs = [&](Time a, Time b) {
    return to_ms(std::chrono::abs(b - a - mean)) > kRegular * to_ms(mean);
  };
  return std::ranges::adjacent_find(at, differs) == at.end();
}

/// Whether the arrivals go on: they fill half of the recording, or enough of them last until its end.
bool go_on(const std::vector<Time>& at, Duration mean, Time begin, Time end) {
  return 2 * std::ssize(at) * mean >= end - begin ||
         (at.size() >= kFewestRecurring && end - at.back() <= 2 * mean);
}

std::string in_ms(Duration time) { return program::concat(program::fixed(to_ms(time), 1), " ms"); }

/// Timers that take turns so that the period of each exceeds the largest deviation of an arrival from
/// the mean distance; none if that takes too many.
OutsideReleases with_jitter(const std::vector<Time>& at, Duration mean) {
  std::vector<Time> due;  // the first timestamp of a timer of the mean period, if this sample is on time
  for (std::size_t i = 0; i < at.size(); ++i) due.push_back(at[i] - mean * static_cast<std::int64_t>(i));
  const auto [earliest, latest] = std::ranges::minmax(due);
  const std::int64_t timers = (latest - earliest) / mean + 1;
  if (timers > static_cast<std::int64_t>(kMostTimers)) return {};
  OutsideReleases releases{{}, timers * mean, latest - earliest, {}};
  for (std::int64_t i = 0; i < timers; ++i) releases.first.push_back(earliest + i * mean);
  releases.timers = program::concat(timers == 1 ? "a timer" : program::concat(timers, " timers"), " of ",
                                    in_ms(releases.period), " with a release jitter of ",
                                    in_ms(releases.jitter), ", which covers all ", at.size(), " arrivals");
  return releases;
}

}  // namespace

OutsideReleases outside_releases(const std::vector<Time>& at, Time begin, Time end) {
  const auto n = static_cast<std::int64_t>(at.size());
  const Duration mean = std::max(Duration(1000), (at.back() - at.front()) / std::max<std::int64_t>(1, n - 1));
  const bool goes_on = go_on(at, mean, begin, end);
  if (goes_on && is_regular(at, mean))
    return {{at.front()}, mean, {}, program::concat("a timer of ", in_ms(mean))};
  if (at.size() < kFewestRecurring)
    return {
        at, kOnce, {}, program::concat(n, n == 1 ? " timer" : " timers", " for one release, at its arrival")};
  if (at.size() <= kMostTimers) {
    const Duration period = std::max(n * mean, end - begin);
    return {at, period, {}, program::concat(n, " timers of ", in_ms(period), ", one for each arrival")};
  }
  OutsideReleases releases = goes_on ? with_jitter(at, mean) : OutsideReleases{};
  if (!releases.first.empty()) return releases;
  const Duration rate = goes_on ? mean : std::max(mean, (end - begin) / n);
  return {{at.front()},
          rate,
          {},
          program::concat("a timer of ", in_ms(rate), ", without the bursts of arrivals")};
}

}  // namespace hotpath::imports
