// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/waters_experiment.hpp"

#include <algorithm>
#include <cmath>

#include "hotpath/analysis/brueggen_2015.hpp"
#include "hotpath/analysis/davare_2007.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "hotpath/analysis/duerr_2019.hpp"
#include "hotpath/analysis/guenzel_2023.hpp"
#include "hotpath/analysis/kloda_2018.hpp"
#include "hotpath/analysis/parallel.hpp"
#include "hotpath/analysis/teper_2024.hpp"

namespace hotpath {

namespace {

/// Random streams of one task set. The phases have a separate stream, so that other draws do not
/// depend on whether phases are needed.
enum Stream : std::uint64_t { kTasksAndChains, kPhases };

std::int64_t end_to_end(WatersMethod method, const PeriodicTasks& tasks, const PeriodicTasks& phased,
                        const ResponseTimes& bounds, const TaskChain& chain) {
  switch (method) {
    case WatersMethod::brueggen_davare:
    case WatersMethod::davis_davare:
      return davare_2007(tasks, bounds, chain);
    case WatersMethod::davis_duerr:
      return duerr_2019_reaction_time(tasks, bounds, chain);
    case WatersMethod::davis_kloda:
      return kloda_2018(tasks, bounds, chain);
    case WatersMethod::davis_guenzel:
      return guenzel_2023(phased, bounds, chain);
  }
  return 0;
}

PeriodicTasks with_phases(PeriodicTasks tasks, RandomStream random) {
  for (PeriodicTask& t : tasks)
    t.phase = static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(t.period)));
  return tasks;
}

/// Analyses one task set.
WatersResult evaluate(const WatersOptions& options, std::uint32_t level, std::uint32_t index) {
  // Seeded by the utilisation, not its position, so that a level's sets do not depend on the other
  // levels.
  const double utilisation = options.utilisations[level];
  const auto place = static_cast<std::uint64_t>(std::llround(utilisation * 1e9));
  RandomStream random(options.seed, {place, index, kTasksAndChains});
  const PeriodicTasks tasks = waters_task_set(utilisation, random);
  const std::vector<TaskChain> chains = waters_chains(tasks, random);

  WatersResult one;
  one.sets = {{.level = level,
               .set = index,
               .tasks = static_cast<std::uint32_t>(tasks.size()),
               .chains = static_cast<std::uint32_t>(chains.size())}};
  WatersSet& set = one.sets.front();
  const ResponseTimes theorem1 = brueggen_2015(tasks);
  set.schedulable_brueggen = schedulable(tasks, theorem1);
  const bool needs_davis =
      std::ranges::any_of(options.methods, [](auto m) { return m != WatersMethod::brueggen_davare; });
  ResponseTimes exact_times;
  if (needs_davis) {
    exact_times = davis_2007(tasks);
    set.schedulable_davis = schedulable(tasks, exact_times);
  }
  if (!set.schedulable_brueggen && !set.schedulable_davis) return one;

  const PeriodicTasks phased = with_phases(tasks, RandomStream(options.seed, {place, index, kPhases}));
  const std::vector<std::int64_t> latency = teper_2024_timers(tasks);
  one.rows.reserve(chains.size());
  for (std::size_t c = 0; c < chains.size(); ++c) {
    WatersRow row{.level = level,
                  .set = index,
                  .chain = static_cast<std::uint32_t>(c),
                  .length = static_cast<std::uint32_t>(chains[c].size())};
    for (const std::size_t i : chains[c]) row.default_bound += latency[i];
    for (std::size_t m = 0; m < options.methods.size(); ++m) {
      const bool first_theorem = options.methods[m] == WatersMethod::brueggen_davare;
      const bool accepted = first_theorem ? set.schedulable_brueggen : set.schedulable_davis;
      row.bound[m] = accepted ? end_to_end(options.methods[m], tasks, phased,
                                           first_theorem ? theorem1 : exact_times, chains[c])
                              : -1;
    }
    one.rows.push_back(row);
  }
  return one;
}

void check(const WatersOptions& options) {
  if (options.utilisations.empty() || options.sets == 0) {
    throw AnalysisError("the WATERS experiment needs at least one utilisation and one task set");
  }
  if (options.methods.empty() || options.methods.size() > kWatersMethods) {
    throw AnalysisError("the WATERS experiment takes 1 to " + std::to_string(kWatersMethods) +
                        " methods, not " + std::to_string(options.methods.size()));
  }
}

}  // namespace

WatersResult run_waters(const WatersOptions& options) {
  check(options);
  std::vector<WatersResult> done(std::size_t{options.sets} * options.utilisations.size());
  for_each_index(done.size(), options.threads, [&](std::size_t number) {
    done[number] = evaluate(options, static_cast<std::uint32_t>(number / options.sets),
                            static_cast<std::uint32_t>(number % options.sets));
  });
  WatersResult all;
  for (const WatersResult& one : done) {
    all.sets.insert(all.sets.end(), one.sets.begin(), one.sets.end());
    all.rows.insert(all.rows.end(), one.rows.begin(), one.rows.end());
  }
  return all;
}

}  // namespace hotpath
