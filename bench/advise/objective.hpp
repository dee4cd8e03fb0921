// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <string>
#include <vector>

#include "hotpath/reference_system/graph.hpp"
#include "results/summary.hpp"

namespace hotpath::advise {

/// The quantity that `hotpath advise --for` minimises.
struct Objective {
  enum class Kind : std::uint8_t { latency, worst_lateness, losses, requirements };
  /// Of the hot-path latency; `age`: the worst end-to-end latency.
  enum class Statistic : std::uint8_t { median, p99, worst, age };
  /// A limit of a chain's end-to-end latency.
  struct Requirement {
    std::size_t chain = 0;  ///< Index into the graph's chains.
    double most_ms = 0;     ///< > 0.
  };

  Kind kind = Kind::latency;
  Statistic statistic = Statistic::p99;  ///< latency.
  std::size_t chain = 0;                 ///< latency: index into the graph's chains.
  std::vector<Requirement> requirements = {};
  /// By chain of the graph: has exact worst cases, since all sources are timers.
  std::vector<bool> from_timers = {};
  std::string text = {};  ///< In words, such as `p99 of hot_path`.

  /// Whether it is about the hot-path latency of the chain, not the end-to-end latency.
  [[nodiscard]] bool of_hot_path() const { return kind == Kind::latency && statistic != Statistic::age; }
  /// Whether it is about worst cases of latencies or response times, which theory can guarantee.
  [[nodiscard]] bool of_worst_cases() const {
    return kind == Kind::latency ? statistic >= Statistic::worst : kind != Kind::losses;
  }
};
constexpr auto enum_texts(Objective::Statistic) {
  using enum Objective::Statistic;
  return std::to_array<EnumText<Objective::Statistic>>(
      {{median, "median"}, {p99, "p99"}, {worst, "worst"}, {age, "age"}});
}

/// Parses `hot_path:p99` (also median, worst, age) for the first chain, `CHAIN:p99` for another chain, a
/// list of `CHAIN<MS` with commas, `worst_lateness`, or `losses`. Throws UsageError, also if the
/// graph lacks the chain.
[[nodiscard]] Objective parse_objective(const std::string& text, const Graph& graph);

/// How well an objective is met; smaller is better. `tie` decides between equal values.
struct Score {
  double value = 0, tie = 0;
  friend std::partial_ordering operator<=>(const Score&, const Score&) = default;
};
/// The value of requirements is the sum by which worst-case latencies exceed their limits, in
/// percent of the limit. Lateness is in ms (negative: before the deadline), losses in percent,
/// latencies in ms. Without samples the value is infinite.
[[nodiscard]] Score score(const Objective& objective, const results::ExecutorSummary& summary);

}  // namespace hotpath::advise
