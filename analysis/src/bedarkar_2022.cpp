// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/bedarkar_2022.hpp"

#include <algorithm>
#include <queue>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

std::int64_t bedarkar_2022(const PeriodicTasks& tasks) {
  check_tasks(tasks, {.method = "the FIFO bound (bedarkar_2022)",
                      .instead = "davis_2007 (exact NP-FP), for a fixed-priority executor,",
                      .jitter = false,
                      .overload = false});
  using Arrival = std::pair<std::int64_t, std::size_t>;
  std::priority_queue<Arrival, std::vector<Arrival>, std::greater<>> arrivals;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    arrivals.push({0, i});
  }
  std::int64_t work = 0, response = 0;
  for (std::uint64_t step = 0;; ++step) {
    if (step == exact::kMaxSteps) exact::report_slow_convergence();
    const std::int64_t t = arrivals.top().first;
    if (t > 0 && work <= t) return response;  // the busy period has ended
    while (arrivals.top().first == t) {
      const std::size_t i = arrivals.top().second;
      arrivals.pop();
      work = exact::add(work, tasks[i].wcet);
      arrivals.push({exact::add(t, tasks[i].period), i});
    }
    response = std::max(response, work - t);
  }
}

}  // namespace hotpath
