// SPDX-License-Identifier: Apache-2.0
#include "commands/paper_threads.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <vector>

#include "bounds/exact_worst_cases.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "program/json_output.hpp"
#include "program/table.hpp"
#include "program/text.hpp"
#include "setup/deployed_system.hpp"

namespace hotpath::commands {

namespace {

constexpr std::size_t kChainCount = 3;
const std::string kThreeChains = "three_chains", kTwoThreads = "multi:2";

/// Values in ms that are published as upper bounds on the latencies of the chains.
struct Published {
  const char* source;
  bool any_phases;  ///< False: all timers begin at one instant.
  std::array<double, kChainCount> ms;
};
constexpr std::array kPublished = {
    Published{"Radulescu 2025, schedule-abstraction graph", false, {45.449, 56.099, 62.299}},
    Published{"Jiang 2022, as the artifact of Radulescu 2025 computes it", true, {54.1, 76.1, 104.0}},
    Published{"Jiang 2022, with the last chain's part", true, {103.3, 103.3, 103.3}}};

/// Phases under which some chain lasts long, found by a search over random phases; first those of the graph.
const std::vector<std::vector<std::string>> kLongPhases = {
    {},
    {"N/a1.phase_ms=73.8", "N/b1.phase_ms=71", "N/c1.phase_ms=71"},
    {"N/a1.phase_ms=29.4", "N/b1.phase_ms=11.7", "N/c1.phase_ms=129.2"},
    {"N/a1.phase_ms=11.1", "N/b1.phase_ms=2.1", "N/c1.phase_ms=152.3"}};

struct ReachedAge {
  std::int64_t ns = 0;
  std::size_t phases = 0;  ///< Index into kLongPhases.
};

std::string in_ms(std::int64_t ns) { return program::fixed(static_cast<double>(ns) / 1e6, 3); }

/// The exact worst case of each chain with these phases.
std::array<std::int64_t, kChainCount> exact_ages(const std::vector<std::string>& phases,
                                                 const setup::ExecutorSpec& executor) {
  Graph graph = load_graph(find_graph(kThreeChains), phases);
  graph.platform.cores = worker_count(*executor.entry, executor.scheduler);
  const GraphBounds exact =
      bounds::exact_worst_cases(graph, make_tasks(graph), *executor.entry, executor.scheduler);
  if (exact.refusal) throw AnalysisError(*exact.refusal);
  std::array<std::int64_t, kChainCount> ages{};
  for (std::size_t c = 0; c < kChainCount; ++c) ages[c] = exact.chains[c]->latency;
  return ages;
}

/// By chain: with the phases of the graph, and with those of kLongPhases under which it lasts longest.
std::array<std::array<ReachedAge, kChainCount>, 2> reached_ages(const setup::ExecutorSpec& executor) {
  std::array<std::array<ReachedAge, kChainCount>, 2> reached{};
  for (std::size_t p = 0; p < kLongPhases.size(); ++p) {
    const auto ages = exact_ages(kLongPhases[p], executor);
    for (std::size_t c = 0; c < kChainCount; ++c) {
      if (p == 0) reached[0][c] = {ages[c], 0};
      if (ages[c] > reached[1][c].ns) reached[1][c] = {ages[c], p};
    }
  }
  return reached;
}

/// A value is refuted by a longer schedule, and confirmed by an upper bound that it does not undercut.
std::string verdict(std::int64_t published, std::int64_t reached, std::int64_t most) {
  if (reached > published) return "refuted";
  return published >= most ? "confirmed" : "open";
}

std::string replay(std::size_t phases) {
  std::string set;
  for (const std::string& phase : kLongPhases[phases]) set += (set.empty() ? " --set " : ",") + phase;
  return "hotpath analyze " + kThreeChains + " --executors " + kTwoThreads + " --cores 2 --phases given" +
         set + " --witness schedule" + std::to_string(phases);
}

}  // namespace

void judge_published_threads() {
  const setup::ExecutorSpec executor = setup::parse_executor(kTwoThreads, {});
  Graph graph = load_graph(find_graph(kThreeChains));
  graph.platform.cores = worker_count(*executor.entry, executor.scheduler);
  const auto bounds = setup::guarantees(graph, make_tasks(graph), executor);
  const auto reached = reached_ages(executor);
  program::Table table(
      "Published bounds on chains under " + kTwoThreads + ", execution times in [C/2, C], in ms",
      {"source", "phases", "chain", "published", "reached", "at most", "verdict", "schedule"});
  for (const Published& p : kPublished) {
    for (std::size_t c = 0; c < kChainCount; ++c) {
      const ReachedAge& longest = reached[p.any_phases ? 1 : 0][c];
      const std::int64_t most = p.any_phases ? bounds.value().chains[c].age.value().ns : longest.ns;
      const std::int64_t published = std::llround(p.ms[c] * 1e6);
      table.add_row({p.source, p.any_phases ? "any" : "all 0", graph.chains[c].name, in_ms(published),
                     in_ms(longest.ns), in_ms(most), verdict(published, longest.ns, most),
                     static_cast<std::int64_t>(longest.phases)});
    }
  }
  std::cout << table << "\nThe schedules, as runs that `hotpath report` and `hotpath explain` read:\n";
  for (std::size_t p = 0; p < kLongPhases.size(); ++p) std::cout << p << ": " << replay(p) << "\n";
  program::show_json(json_of(table));
}

}  // namespace hotpath::commands
