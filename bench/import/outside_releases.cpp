// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_graph.hpp"

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

/// Whether the arrivals go on beyond the recording: they fill half of it, or enough of them last until
/// its end. Others are a burst.
bool go_on(const std::vector<Time>& at, Duration mean, const RecordedTime& recorded) {
  const auto n = static_cast<std::int64_t>(at.size());
  return 2 * n * mean >= recorded.length() ||
         (at.size() >= kFewestRecurring && recorded.end - at.back() <= 2 * mean);
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

OutsideReleases outside_releases(const std::vector<Time>& at, const RecordedTime& recorded) {
  const auto n = static_cast<std::int64_t>(at.size());
  const Duration mean = std::max(Duration(1000), (at.back() - at.front()) / std::max<std::int64_t>(1, n - 1));
  const bool goes_on = go_on(at, mean, recorded);
  if (goes_on && is_regular(at, mean))
    return {{at.front()}, mean, {}, program::concat("a timer of ", in_ms(mean))};
  if (at.size() < kFewestRecurring)
    return {at,
            kOnce,
            {},
            n == 1 ? "a timer that fires once, when it arrived"
                   : program::concat(n, " timers that fire once, when they arrived")};
  if (at.size() <= kMostTimers) {
    const Duration period = std::max(n * mean, recorded.length());
    return {at, period, {}, program::concat(n, " timers of ", in_ms(period), ", one for each arrival")};
  }
  OutsideReleases releases = goes_on ? with_jitter(at, mean) : OutsideReleases{};
  if (!releases.first.empty()) return releases;
  const Duration rate = goes_on ? mean : std::max(mean, recorded.length() / n);
  return {{at.front()},
          rate,
          {},
          program::concat("a timer of ", in_ms(rate), ", the mean distance of ", n,
                          " arrivals, whose bursts the graph lacks")};
}

}  // namespace hotpath::imports
