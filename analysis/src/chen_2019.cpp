// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/chen_2019.hpp"

#include <algorithm>

#include "interference.hpp"

namespace hotpath {

ResponseTimes chen_2019(const SequenceTasks& tasks) {
  using exact::add, exact::multiply;
  check_sequences(tasks, "self-suspension (chen_2019)", false);
  std::vector<std::int64_t> longest_lower(tasks.size(), 0);
  for (std::size_t k = tasks.size() - 1; k > 0; --k) {
    longest_lower[k - 1] = std::max(longest_lower[k], tasks[k].longest_segment());
  }
  Interference higher;
  ResponseTimes bounds;
  for (std::size_t k = 0; k < tasks.size(); ++k) {
    const SequenceTask& s = tasks[k];
    // The jitter R_h - C_h requires a bound for every task of higher priority.
    if (k > 0 && !bounds.back()) {
      bounds.push_back(std::nullopt);
      continue;
    }
    const auto parts = static_cast<std::int64_t>(s.segments.size());
    const std::int64_t own = add(add(s.wcet(), s.suspension), multiply(parts, longest_lower[k]));
    bounds.push_back(exact::least_fixed_point(
        add(own, higher.once()), [&](std::int64_t t) { return add(own, higher.before(t)); }, s.deadline));
    if (bounds.back()) higher.add(s.wcet(), s.period, *bounds.back() - s.wcet());
  }
  return bounds;
}

}  // namespace hotpath
