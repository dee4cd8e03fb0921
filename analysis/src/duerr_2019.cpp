// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/duerr_2019.hpp"

#include <algorithm>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

using exact::add;

std::int64_t duerr_2019_reaction_time(const PeriodicTasks& tasks, const ResponseTimes& bounds,
                                      const TaskChain& chain, Priorities priorities) {
  check_chain(tasks, bounds, chain, "duerr_2019");
  std::int64_t sum = add(tasks[chain.front()].period, *bounds[chain.back()]);
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    const std::int64_t sampled =
        add(tasks[chain[i + 1]].period, handover_delay(tasks, bounds, chain, i, priorities));
    sum = add(sum, std::max(*bounds[chain[i]], sampled));
  }
  return sum;
}

}  // namespace hotpath
