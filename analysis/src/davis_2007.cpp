// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/davis_2007.hpp"

#include <algorithm>

#include "busy_window.hpp"

namespace hotpath {

namespace {

/// Largest response time of `task` over its level's busy window. `higher` are the tasks of higher
/// priority, `longest_lower` is the longest job of lower priority; `utilisation` includes the task.
/// std::nullopt if the window never ends: the utilisation is above 1, or equal to 1 with blocking
/// or jitter.
std::optional<std::int64_t> largest_response(const PeriodicTask& task, const Interference& higher,
                                             std::int64_t longest_lower,
                                             const exact::Utilisation& utilisation, TimeModel model) {
  using exact::add, exact::multiply;
  const std::int64_t blocked = blocking(longest_lower, model);
  const int load = utilisation.compare_to_one();
  const bool endless_at_one = blocked > 0 || task.jitter > 0 || higher.has_jitter();
  if (load > 0 || (load == 0 && endless_at_one)) return std::nullopt;

  const auto own_jobs = [&](std::int64_t t) { return exact::ceil_div(add(t, task.jitter), task.period); };
  const std::int64_t start = add(add(blocked, higher.once()), task.wcet);
  const std::int64_t window = *exact::least_fixed_point(start, [&](std::int64_t t) {
    return add(add(blocked, higher.before(t)), multiply(own_jobs(t), task.wcet));
  });

  const bool closed = ties_interfere(blocked, model);
  const std::int64_t jobs = own_jobs(window);
  std::int64_t response = 0;
  std::int64_t w = add(blocked, higher.once());
  for (std::int64_t q = 0; q < jobs; ++q) {
    const std::int64_t fixed = add(blocked, multiply(q, task.wcet));
    w = *exact::least_fixed_point(
        w, [&](std::int64_t t) { return add(fixed, closed ? higher.through(t) : higher.before(t)); });
    response = std::max(response, add(add(w, task.wcet), task.jitter) - multiply(q, task.period));
    w = add(w, task.wcet);
  }
  return response;
}

}  // namespace

ResponseTimes davis_2007(const PeriodicTasks& tasks, TimeModel model) {
  check_tasks(tasks, {.method = "exact NP-FP (davis_2007)", .instead = ""});
  std::vector<std::int64_t> longest_lower(tasks.size(), 0);
  for (std::size_t k = tasks.size() - 1; k > 0; --k) {
    longest_lower[k - 1] = std::max(longest_lower[k], tasks[k].wcet);
  }
  Interference higher;
  exact::Utilisation utilisation;
  ResponseTimes bounds;
  bounds.reserve(tasks.size());
  for (std::size_t k = 0; k < tasks.size(); ++k) {
    const PeriodicTask& t = tasks[k];
    utilisation.add(t.wcet, t.period);
    bounds.push_back(largest_response(t, higher, longest_lower[k], utilisation, model));
    higher.add(t.wcet, t.period, t.jitter);
  }
  return bounds;
}

}  // namespace hotpath
