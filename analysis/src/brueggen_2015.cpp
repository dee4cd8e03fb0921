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

std::optional<std::int64_t> fixed_point(std::int64_t wcet, std::int64_t blocked, const Interference& higher,
                                        std::int64_t limit) {
  const std::int64_t own = exact::add(wcet, blocked);
  return exact::least_fixed_point(
      exact::add(own, higher.once()), [&](std::int64_t t) { return exact::add(own, higher.before(t)); },
      limit);
}

}  // namespace

ResponseTimes brueggen_2015(const PeriodicTasks& tasks) {
  check_tasks(tasks, kScope);
  std::vector<std::int64_t> blocked(tasks.size(), 0);
  for (std::size_t k = tasks.size() - 1; k > 0; --k) blocked[k - 1] = std::max(blocked[k], tasks[k].wcet);
  Interference higher;
  ResponseTimes bounds;
  bounds.reserve(tasks.size());
  for (std::size_t k = 0; k < tasks.size(); ++k) {
    bounds.push_back(fixed_point(tasks[k].wcet, blocked[k], higher, tasks[k].deadline));
    higher.add(tasks[k].wcet, tasks[k].period, 0);
  }
  return bounds;
}

std::optional<std::int64_t> brueggen_2015_fixed_point(const PeriodicTasks& tasks, std::size_t k,
                                                      std::int64_t limit) {
  check_tasks(tasks, kScope);
  Interference higher;
  for (std::size_t i = 0; i < k; ++i) higher.add(tasks[i].wcet, tasks[i].period, 0);
  std::int64_t blocked = 0;
  for (std::size_t i = k + 1; i < tasks.size(); ++i) blocked = std::max(blocked, tasks[i].wcet);
  return fixed_point(tasks[k].wcet, blocked, higher, limit);
}

}  // namespace hotpath
