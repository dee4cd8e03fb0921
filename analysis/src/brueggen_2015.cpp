// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/brueggen_2015.hpp"

#include <algorithm>

#include "interference.hpp"

namespace hotpath {

namespace {

constexpr MethodScope kScope = {.method = "Theorem 1 (brueggen_2015)",
                                .instead = "davis_2007 (exact NP-FP)",
                                .arbitrary_deadlines = false,
                                .jitter = false};

}  // namespace

ResponseTimes brueggen_2015(const PeriodicTasks& tasks) {
  check_tasks(tasks, kScope);
  std::vector<std::int64_t> blocked(tasks.size(), 0);
  for (std::size_t k = tasks.size() - 1; k > 0; --k) blocked[k - 1] = std::max(blocked[k], tasks[k].wcet);
  Interference higher;
  ResponseTimes bounds;
  bounds.reserve(tasks.size());
  for (std::size_t k = 0; k < tasks.size(); ++k) {
    const std::int64_t own = exact::add(tasks[k].wcet, blocked[k]);
    bounds.push_back(exact::least_fixed_point(
        exact::add(own, higher.once()), [&](std::int64_t t) { return exact::add(own, higher.before(t)); },
        tasks[k].deadline));
    higher.add(tasks[k].wcet, tasks[k].period, 0);
  }
  return bounds;
}

}  // namespace hotpath
