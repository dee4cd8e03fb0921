// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/bedarkar_2022.hpp"

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

std::int64_t bedarkar_2022(const PeriodicTasks& tasks) {
  check_tasks(tasks, {.method = "the FIFO bound (bedarkar_2022)",
                      .instead = "davis_2007 (exact NP-FP), for a fixed-priority executor,",
                      .jitter = false,
                      .overload = false});
  // The backlog at an arrival A, sum (floor(A / T_j) + 1) C_j - A, is at most sum C_j + (U - 1) A,
  // which is largest at A = 0.
  std::int64_t backlog = 0;
  for (const PeriodicTask& t : tasks) backlog = exact::add(backlog, t.wcet);
  return backlog;
}

}  // namespace hotpath
