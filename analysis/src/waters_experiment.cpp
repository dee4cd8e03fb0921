// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/waters_experiment.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <thread>

#include "hotpath/analysis/brueggen_2015.hpp"
#include "hotpath/analysis/davare_2007.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "hotpath/analysis/duerr_2019.hpp"
#include "hotpath/analysis/guenzel_2023.hpp"
#include "hotpath/analysis/kloda_2018.hpp"
#include "hotpath/analysis/teper_2024.hpp"

namespace hotpath {

namespace {

/// Streams of one task set; the phases have their own, so that no other draw depends on whether they are
/// needed.
enum Stream : std::uint64_t { kTasksAndChains, kPhases };

struct OneSet {
  WatersSet set;
  std::vector<WatersRow> rows;
};

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

OneSet evaluate(const WatersOptions& options, std::uint32_t level, std::uint32_t index) {
  // The utilisation itself, not its position, so that a level's sets are the same whichever others are run.
  const double utilisation = options.utilisations[level];
  const auto place = static_cast<std::uint64_t>(std::llround(utilisation * 1e9));
  RandomStream random(options.seed, {place, index, kTasksAndChains});
  const PeriodicTasks tasks = waters_task_set(utilisation, random);
  const std::vector<TaskChain> chains = waters_chains(tasks, random);

  OneSet one;
  one.set = {.level = level,
             .set = index,
             .tasks = static_cast<std::uint32_t>(tasks.size()),
             .chains = static_cast<std::uint32_t>(chains.size())};
  const ResponseTimes theorem1 = brueggen_2015(tasks);
  one.set.schedulable_brueggen = schedulable(tasks, theorem1);
  const bool needs_davis = std::any_of(options.methods.begin(), options.methods.end(),
                                       [](WatersMethod m) { return m != WatersMethod::brueggen_davare; });
  ResponseTimes exact_times;
  if (needs_davis) {
    exact_times = davis_2007(tasks);
    one.set.schedulable_davis = schedulable(tasks, exact_times);
  }
  if (!one.set.schedulable_brueggen && !one.set.schedulable_davis) return one;

  PeriodicTasks phased;
  if (std::find(options.methods.begin(), options.methods.end(), WatersMethod::davis_guenzel) !=
      options.methods.end()) {
    phased = tasks;
    RandomStream phases(options.seed, {place, index, kPhases});
    for (PeriodicTask& t : phased) {
      t.phase = static_cast<std::int64_t>(phases.below(static_cast<std::uint64_t>(t.period)));
    }
  }
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
      const bool accepted = first_theorem ? one.set.schedulable_brueggen : one.set.schedulable_davis;
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

WatersResult waters_share(const WatersOptions& options, std::uint32_t rank, std::uint32_t ranks) {
  check(options);
  if (rank >= ranks) {
    throw AnalysisError("rank " + std::to_string(rank) + " does not exist among " + std::to_string(ranks));
  }
  const std::uint64_t total = std::uint64_t{options.sets} * options.utilisations.size();
  const std::uint64_t mine = total / ranks + (rank < total % ranks);
  std::vector<OneSet> done(mine);

  std::atomic<std::uint64_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_lock;
  const auto work = [&] {
    try {
      for (std::uint64_t i = next++; i < mine; i = next++) {
        const std::uint64_t number = rank + i * ranks;
        done[i] = evaluate(options, static_cast<std::uint32_t>(number / options.sets),
                           static_cast<std::uint32_t>(number % options.sets));
      }
    } catch (...) {
      next = mine;
      const std::lock_guard lock(failure_lock);
      failure = std::current_exception();
    }
  };
  const unsigned threads =
      options.threads > 0 ? options.threads : std::max(1U, std::thread::hardware_concurrency());
  {
    std::vector<std::jthread> helpers;
    for (unsigned t = 1; t < threads; ++t) helpers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);

  WatersResult result;
  for (OneSet& one : done) {
    result.sets.push_back(one.set);
    result.rows.insert(result.rows.end(), one.rows.begin(), one.rows.end());
  }
  return result;
}

WatersResult run_waters(const WatersOptions& options) { return waters_share(options, 0, 1); }

}  // namespace hotpath
