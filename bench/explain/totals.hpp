// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <map>
#include <tuple>
#include <vector>

#include "explain/causes.hpp"
#include "explain/explainer.hpp"

namespace hotpath::explain {

using CauseTimes = std::array<Duration, kCauses>;
[[nodiscard]] CauseTimes causes_of(const Explanation& explanation);

struct CauseSums {
  std::uint64_t outputs = 0;
  Duration latency{};
  CauseTimes causes{};
  CauseSums& operator+=(const CauseSums& other);
};

/// What was waited for.
struct Behind {
  Cause cause = Cause::unexplained;
  Rule rule = Rule::none;
  TaskId task = kNoTask;
  friend auto operator<=>(const Behind&, const Behind&) = default;
};

/// Sums over many outputs.
struct Totals : CauseSums {
  std::map<Behind, Duration> behind = {};  ///< Parts with another job, of `waits` outputs.
  std::uint64_t waits = 0;

  void add(const Explanation& explanation);
  /// Means in ms; 0 without outputs.
  [[nodiscard]] double mean_ms() const { return mean_ms(latency, outputs); }
  [[nodiscard]] double mean_ms(Cause cause) const {
    return mean_ms(causes[static_cast<std::size_t>(cause)], outputs);
  }
  [[nodiscard]] double mean_ms(const Behind& key) const;

 private:
  [[nodiscard]] static double mean_ms(Duration sum, std::uint64_t count);
};

/// Share of the outputs in the tail.
inline constexpr double kTail = 0.01;

/// The output at a quantile in [0, 1]: the smallest that at least this share of outputs do not
/// exceed. `outputs` must not be empty.
[[nodiscard]] const Output& at_quantile(const std::vector<Output>& by_latency, double quantile);
[[nodiscard]] std::vector<Output> sorted_by_latency(std::vector<Output> outputs);

/// The causes of all outputs, of those around the median, and of the worst.
class Overview {
 public:
  /// `outputs` must not be empty.
  explicit Overview(const std::vector<Output>& outputs);
  void add(const Explanation& explanation);

  Totals all, middle, tail;

 private:
  Duration middle_from_{}, middle_to_{}, tail_from_{};
};

/// All outputs of one side of a comparison.
struct ComparedOutputs {
  Totals totals;
  /// Those whose source job is known, by its repetition, task and sequence.
  std::multimap<std::tuple<std::uint32_t, TaskId, std::uint64_t>, CauseSums> by_source;
  void add(const Explanation& explanation);
};

/// Two runs of the same outputs, or two sets of outputs.
struct Comparison {
  Totals a, b;
  bool paired = false;
};
/// Pairs outputs with data of the same source job, if these are most of both sets and `pairs` is
/// true; otherwise compares all outputs. Totals::behind is always of all outputs.
[[nodiscard]] Comparison compare(const ComparedOutputs& a, const ComparedOutputs& b, bool pairs);

}  // namespace hotpath::explain
