// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/davare_2007.hpp"

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

std::int64_t davare_2007(const PeriodicTasks& tasks, const ResponseTimes& bounds, const TaskChain& chain) {
  check_chain(tasks, bounds, chain, "davare_2007");
  std::int64_t sum = 0;
  for (const std::size_t i : chain) sum = exact::add(sum, exact::add(tasks[i].period, *bounds[i]));
  return sum;
}

}  // namespace hotpath
