// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <string>
#include <vector>

#include "hotpath/reference_system/graph.hpp"
#include "results/summary.hpp"

namespace hotpath {

/// What `hotpath advise --for` asks to be small.
struct Objective {
  enum class Kind : std::uint8_t { latency, worst_lateness, losses, requirements };
  enum class Statistic : std::uint8_t { median, p99, worst };
  /// A chain's end-to-end latency that is allowed.
  struct Requirement {
    std::size_t chain = 0;  ///< Index into the graph's chains.
    double most_ms = 0;     ///< > 0.
  };

  Kind kind = Kind::latency;
  Statistic statistic = Statistic::p99;  ///< latency.
  std::size_t chain = 0;                 ///< latency: index into the graph's chains.
  std::vector<Requirement> requirements;
  std::string text;  ///< In words, such as `p99 of hot_path`.
};

/// `hot_path:p99` (also median, worst) for the first chain, `CHAIN:p99` for another, `CHAIN<MS`, several with
/// commas between, `worst_lateness`, or `losses`. Throws UsageError, also where the graph has no chain for
/// it.
[[nodiscard]] Objective parse_objective(const std::string& text, const Graph& graph);

/// How well an objective is met, the smaller the better: first what counts, then what decides among equals.
struct Score {
  double value = 0, tie = 0;
  friend std::partial_ordering operator<=>(const Score&, const Score&) = default;
};

/// Lost timestamps and samples in percent of all.
[[nodiscard]] double loss_percent(const ExecutorSummary& summary);

/// Of requirements, the value is the sum of the latencies' excess in percent of what is allowed, by the worst
/// case; of lateness it is in ms (negative: before the deadline), of losses in percent, of latencies in ms.
/// What cannot be told, as there is no sample, is infinite.
[[nodiscard]] Score score(const Objective& objective, const ExecutorSummary& summary);

/// The median, p99 or worst case of a latency.
[[nodiscard]] double statistic_of(Objective::Statistic statistic, const LatencySummary& latency);

}  // namespace hotpath
