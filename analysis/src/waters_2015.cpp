// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/waters_2015.hpp"

#include <algorithm>
#include <cmath>

namespace hotpath {

// WATERS 2015, tables II to V; Weibull parameters as fitted by the paper's authors.
const std::array<WatersPeriod, 9> kWatersPeriods = {{
    {1, 3, 0.34, 30.11, 1.30, 29.11, 1.044, 0.214},
    {2, 2, 0.32, 40.69, 1.54, 19.04, 1.0607440083, 0.2479463059},
    {5, 2, 0.36, 83.38, 1.13, 18.44, 1.00818633, 0.09},
    {10, 25, 0.21, 309.87, 1.06, 30.03, 1.0098, 0.0985},
    {20, 25, 0.25, 291.42, 1.06, 15.61, 1.0130969967, 0.1138186679},
    {50, 3, 0.29, 92.98, 1.13, 7.76, 1.0032421916, 0.0568545046},
    {100, 20, 0.21, 420.43, 1.02, 8.88, 1.0090073603, 0.0944801981},
    {200, 1, 0.22, 21.95, 1.03, 4.90, 1.1571061236, 0.3706045664},
    {1000, 4, 0.37, 0.46, 1.84, 4.75, 0, 0},
}};

namespace {

constexpr double kTolerance = 0.01;
constexpr std::int64_t kNsPerMs = 1'000'000;

std::array<double, 9> cumulative_shares() {
  double total = 0;
  for (const WatersPeriod& p : kWatersPeriods) total += p.share;
  std::array<double, 9> cumulative{};
  double sum = 0;
  for (std::size_t i = 0; i < cumulative.size(); ++i)
    cumulative[i] = (sum += kWatersPeriods[i].share) / total;
  return cumulative;
}

std::int64_t draw_wcet(const WatersPeriod& p, RandomStream& random) {
  double acet = 0;
  do {
    acet = p.rate > 0 ? random.weibull(p.shape, 1 / p.rate) : random.uniform(p.acet_min, p.acet_max);
  } while (acet < p.acet_min || acet > p.acet_max);
  const double wcet_us = acet * random.uniform(p.factor_min, p.factor_max);
  return std::llround(wcet_us * 1000);
}

/// k distinct members of `items`, in random order.
void draw_distinct(std::vector<std::size_t>& items, std::size_t k, RandomStream& random) {
  for (std::size_t i = 0; i < k; ++i) std::swap(items[i], items[i + random.below(items.size() - i)]);
  items.resize(k);
}

}  // namespace

PeriodicTask waters_runnable(RandomStream& random) {
  static const std::array<double, 9> kCumulative = cumulative_shares();
  const WatersPeriod& p = kWatersPeriods[random.pick(kCumulative)];
  const std::int64_t period = p.period_ms * kNsPerMs;
  return {.name = {}, .wcet = draw_wcet(p, random), .period = period, .deadline = period};
}

PeriodicTasks waters_task_set(double utilisation, RandomStream& random) {
  if (!(utilisation > 0 && utilisation < 1)) {
    throw AnalysisError("a WATERS task set cannot have a utilisation of " + std::to_string(utilisation) +
                        "; give a number between 0 and 1");
  }
  PeriodicTasks tasks;
  for (double sum = 0; sum < utilisation;) {
    PeriodicTask task = waters_runnable(random);
    const double added = static_cast<double>(task.wcet) / static_cast<double>(task.period);
    if (sum + added > utilisation + kTolerance) continue;
    sum += added;
    tasks.push_back(std::move(task));
  }
  std::stable_sort(tasks.begin(), tasks.end(),
                   [](const PeriodicTask& a, const PeriodicTask& b) { return a.period < b.period; });
  return tasks;
}

std::vector<TaskChain> waters_chains(const PeriodicTasks& tasks, RandomStream& random) {
  static constexpr std::array kPatterns = {0.7, 0.9, 1.0};
  static constexpr std::array kTasksPerPattern = {0.3, 0.7, 0.9, 1.0};
  // Positions by period; the tasks are sorted by period.
  std::vector<std::pair<std::size_t, std::size_t>> groups;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (i == 0 || tasks[i].period != tasks[i - 1].period) groups.push_back({i, i});
    ++groups.back().second;
  }
  std::vector<TaskChain> chains;
  const std::uint64_t attempts = 30 + random.below(30);
  if (groups.size() < 3) return chains;
  std::vector<std::size_t> chosen, members;
  for (std::uint64_t attempt = 0; attempt < attempts; ++attempt) {
    chosen.resize(groups.size());
    for (std::size_t g = 0; g < groups.size(); ++g) chosen[g] = g;
    draw_distinct(chosen, 1 + random.pick(kPatterns), random);
    TaskChain chain;
    bool complete = true;
    for (const std::size_t g : chosen) {
      const std::size_t wanted = 2 + random.pick(kTasksPerPattern);
      const auto [first, last] = groups[g];
      if (last - first < wanted) {
        complete = false;
        break;
      }
      members.resize(last - first);
      for (std::size_t i = 0; i < members.size(); ++i) members[i] = first + i;
      draw_distinct(members, wanted, random);
      chain.insert(chain.end(), members.begin(), members.end());
    }
    if (!complete) continue;
    random.shuffle(std::span(chain));
    chains.push_back(std::move(chain));
  }
  return chains;
}

}  // namespace hotpath
