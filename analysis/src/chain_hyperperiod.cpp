// SPDX-License-Identifier: Apache-2.0
#include "chain_hyperperiod.hpp"

#include "hotpath/analysis/exact.hpp"
#include "hotpath/analysis/guenzel_2023.hpp"

namespace hotpath {

std::int64_t chain_hyperperiod(const PeriodicTasks& tasks, const TaskChain& chain, const char* method) {
  const std::string needs =
      std::string(" that ") + method + " needs; duerr_2019 and davare_2007 do without it";
  std::int64_t h = 1;
  for (const std::size_t i : chain) {
    const std::int64_t period = tasks[i].period;
    if (period <= 0) {
      throw AnalysisError(task_label(tasks, i) + ": period " + std::to_string(period) +
                          " ns is not positive");
    }
    try {
      h = exact::lcm(h, period);
    } catch (const AnalysisError&) {
      throw AnalysisError(task_label(tasks, i) + ": with its period of " + std::to_string(period) +
                          " ns the chain's hyperperiod exceeds the 64-bit nanoseconds" + needs);
    }
  }
  const std::int64_t releases = h / tasks[chain.front()].period;
  if (releases > kMaxChainReleases) {
    throw AnalysisError("the chain's hyperperiod has " + std::to_string(releases) + " releases of " +
                        task_label(tasks, chain.front()) + ", more than the " +
                        std::to_string(kMaxChainReleases) + needs);
  }
  return h;
}

}  // namespace hotpath
