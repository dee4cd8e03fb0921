// SPDX-License-Identifier: Apache-2.0
#include "import/outside_releases.hpp"

#include <algorithm>

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
  releases.timers =
      program::concat(timers, " timers of ", in_ms(releases.period), " with a release jitter of ",
                      in_ms(releases.jitter), ", which covers all ", at.size(), " arrivals");
  return releases;
}

}  // namespace

OutsideReleases outside_releases(const std::vector<Time>& at) {
  const auto n = static_cast<std::int64_t>(at.size());
  const Duration mean = std::max(Duration(1000), (at.back() - at.front()) / std::max<std::int64_t>(1, n - 1));
  if (is_regular(at, mean)) return {{at.front()}, mean, {}, program::concat("a timer of ", in_ms(mean))};
  if (at.size() < kFewestRecurring)
    return {at,
            kOnce,
            {},
            n == 1 ? "a timer that fires once, when it arrived"
                   : program::concat(n, " timers that fire once, when they arrived")};
  if (at.size() <= kMostTimers)
    return {at, n * mean, {}, program::concat(n, " timers of ", in_ms(n * mean), ", one for each arrival")};
  OutsideReleases releases = with_jitter(at, mean);
  if (!releases.first.empty()) return releases;
  return {{at.front()},
          mean,
          {},
          program::concat("a timer of ", in_ms(mean), ", the mean distance of ", n,
                          " arrivals, whose bursts the graph lacks")};
}

}  // namespace hotpath::imports
