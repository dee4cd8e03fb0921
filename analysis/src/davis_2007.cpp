// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/davis_2007.hpp"

#include <algorithm>

#include "busy_window.hpp"

namespace hotpath {

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
    const LevelTask level = {.wcet = t.wcet,
                             .period = t.period,
                             .jitter = t.jitter,
                             .last_part = t.wcet,
                             .longest_lower = longest_lower[k]};
    bounds.push_back(busy_window_response(level, higher, utilisation, model));
    higher.add(t.wcet, t.period, t.jitter);
  }
  return bounds;
}

}  // namespace hotpath
