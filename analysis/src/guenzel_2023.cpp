// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/guenzel_2023.hpp"

#include <algorithm>

#include "chain_hyperperiod.hpp"
#include "hotpath/analysis/exact.hpp"

namespace hotpath {

namespace {

/// First release of `t` at or after `from`.
std::int64_t next_release(const PeriodicTask& t, std::int64_t from) {
  if (from <= t.phase) return t.phase;
  return exact::add(t.phase, exact::multiply(exact::ceil_div(from - t.phase, t.period), t.period));
}

}  // namespace

std::int64_t guenzel_2023(const PeriodicTasks& tasks, const ResponseTimes& bounds, const TaskChain& chain,
                          Priorities priorities) {
  using exact::add;
  constexpr const char* kMethod = "guenzel_2023";
  check_chain(tasks, bounds, chain, kMethod);
  std::int64_t latest_phase = 0;
  for (const std::size_t i : chain) {
    if (tasks[i].phase < 0) {
      throw AnalysisError(task_label(tasks, i) + ": phase " + std::to_string(tasks[i].phase) +
                          " ns is negative");
    }
    latest_phase = std::max(latest_phase, tasks[i].phase);
  }
  const std::int64_t h = chain_hyperperiod(tasks, chain, kMethod);
  std::vector<std::int64_t> delay(chain.size(), 0);
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    delay[i] = handover_delay(tasks, bounds, chain, i, priorities);
  }

  const PeriodicTask& first = tasks[chain.front()];
  const std::int64_t begin = next_release(first, latest_phase);
  const std::int64_t end = add(begin, h);
  std::int64_t longest = 0;
  for (std::int64_t z = begin; z < end; z = add(z, first.period)) {
    std::int64_t r = z;
    for (std::size_t i = 0; i + 1 < chain.size(); ++i)
      r = next_release(tasks[chain[i + 1]], add(r, delay[i]));
    longest = std::max(longest, r - z);
  }
  return add(add(first.period, longest), *bounds[chain.back()]);
}

}  // namespace hotpath
