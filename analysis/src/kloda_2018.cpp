// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/kloda_2018.hpp"

#include <algorithm>

#include "chain_hyperperiod.hpp"
#include "hotpath/analysis/exact.hpp"

namespace hotpath {

std::int64_t kloda_2018(const PeriodicTasks& tasks, const ResponseTimes& bounds, const TaskChain& chain,
                        Priorities priorities) {
  using exact::add, exact::ceil_div, exact::multiply;
  constexpr const char* kMethod = "kloda_2018";
  check_chain(tasks, bounds, chain, kMethod);
  for (const std::size_t i : chain) {
    if (tasks[i].phase != 0) {
      throw AnalysisError(task_label(tasks, i) + ": phase " + std::to_string(tasks[i].phase) +
                          " ns is not 0, which " + kMethod +
                          " does not allow; guenzel_2023 (known phases) or duerr_2019 (any phases) would");
    }
  }
  const std::int64_t h = chain_hyperperiod(tasks, chain, kMethod);
  struct Step {
    std::int64_t delay, period;
  };
  std::vector<Step> steps;
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    steps.push_back({handover_delay(tasks, bounds, chain, i, priorities), tasks[chain[i + 1]].period});
  }
  const std::int64_t first_period = tasks[chain.front()].period;
  std::int64_t longest = 0;
  for (std::int64_t z = 0; z < h; z += first_period) {
    std::int64_t r = z;
    for (const Step& s : steps) r = multiply(ceil_div(add(r, s.delay), s.period), s.period);
    longest = std::max(longest, r - z);
  }
  return add(add(first_period, longest), *bounds[chain.back()]);
}

}  // namespace hotpath
