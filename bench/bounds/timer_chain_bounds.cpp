// SPDX-License-Identifier: Apache-2.0
#include "bounds/timer_chain_bounds.hpp"

#include <functional>

#include "bounds/methods.hpp"
#include "hotpath/analysis/davare_2007.hpp"
#include "hotpath/analysis/duerr_2019.hpp"
#include "hotpath/analysis/guenzel_2023.hpp"
#include "hotpath/analysis/kloda_2018.hpp"
#include "hotpath/analysis/teper_2024.hpp"

namespace hotpath {

std::vector<ChainBound> timer_chain_bounds(const GraphTasks& tasks, const ExecutorEntry& executor,
                                           Duration delta, const std::vector<std::string>& names) {
  std::vector<ChainBound> bounds;
  const auto add = [&](const char* method, const std::function<std::int64_t()>& latency) {
    ChainBound& b = bounds.emplace_back();
    b.method = method;
    try {
      b.latency = Duration(latency());
    } catch (const AnalysisError& error) {
      b.refusal = error.what();
    }
  };
  if (is_default_executor(executor)) {
    const ExecutorCallbacks callbacks = executor_callbacks(tasks.set);
    const PeriodicTasks in_order = periodic_tasks(tasks.set, Policy::fifo);  // by task, as the wait set
    const TaskChain chain = task_chain(in_order, names, Revisits::allowed);
    add("Teper 2024", [&] { return teper_2024(callbacks, chain); });
    return bounds;
  }
  const std::optional<Policy> policy = analysed_policy(executor);
  if (!policy) return bounds;
  const PeriodicTasks periodic = periodic_tasks(tasks.set, *policy);
  const TaskChain chain = task_chain(periodic, names, Revisits::allowed);
  const Priorities priorities =
      *policy == Policy::edf || *policy == Policy::fifo ? Priorities::dynamic : Priorities::fixed;
  for (const NamedAnalysis& a : analyses(*policy)) {
    const OverheadAwareResponse r =
        with_release_overhead(periodic, delta.count(), release_mode(executor), a.analysis);
    const std::string with = std::string(", ") + a.method;
    add(("Davare 2007" + with).c_str(), [&] { return davare_2007(r.tasks, r.bounds, chain); });
    add(("Duerr 2019" + with).c_str(),
        [&] { return duerr_2019_reaction_time(r.tasks, r.bounds, chain, priorities); });
    add(("Kloda 2018" + with).c_str(), [&] { return kloda_2018(r.tasks, r.bounds, chain, priorities); });
    add(("Guenzel 2023" + with).c_str(), [&] { return guenzel_2023(r.tasks, r.bounds, chain, priorities); });
  }
  return bounds;
}

}  // namespace hotpath
