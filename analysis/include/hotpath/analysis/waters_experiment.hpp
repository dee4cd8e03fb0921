// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/waters_2015.hpp"
#include "hotpath/core/enum_text.hpp"

namespace hotpath {

/// A pair of response time analysis and end-to-end method, compared with the default executor's
/// bound (teper_2024).
enum class WatersMethod : std::uint8_t {
  brueggen_davare,  ///< The paper's: Theorem 1 and Equation (6).
  davis_davare,     ///< Exact NP-FP and Equation (6).
  davis_duerr,      ///< Exact NP-FP and the sporadic reaction time.
  davis_kloda,      ///< Exact NP-FP and the synchronous periodic latency.
  davis_guenzel,    ///< Exact NP-FP and the phase-aware latency, phases drawn uniformly from [0, T).
};
inline constexpr std::size_t kWatersMethods = 5;
constexpr auto enum_texts(WatersMethod) {
  return texts_in_order<WatersMethod>(
      {"brueggen_davare", "davis_davare", "davis_duerr", "davis_kloda", "davis_guenzel"});
}

/// Parameters of the WATERS experiment (paper, Section VII-B).
struct WatersOptions {
  std::uint64_t seed = 1;
  std::vector<double> utilisations = {0.6, 0.8, 0.9};
  std::uint32_t sets = 1000;  ///< Task sets for each utilisation.
  std::vector<WatersMethod> methods = {WatersMethod::brueggen_davare};
  unsigned threads = 0;  ///< 0: one per processor. Does not affect the result.
};

/// Results of one chain: bounds in ns, parallel to WatersOptions::methods; -1 if the set is not
/// schedulable under the method's response time analysis.
struct WatersRow {
  std::uint32_t level = 0;  ///< Index into WatersOptions::utilisations.
  std::uint32_t set = 0;
  std::uint32_t chain = 0;
  std::uint32_t length = 0;
  std::int64_t default_bound = 0;
  std::array<std::int64_t, kWatersMethods> bound{};  ///< Only the first methods.size() are used.

  /// (E_default - E) / E_default of method `m` of the options.
  double reduction(std::size_t m) const {
    return static_cast<double>(default_bound - bound[m]) / static_cast<double>(default_bound);
  }
  friend bool operator==(const WatersRow&, const WatersRow&) = default;
};

/// Results of one task set; unschedulable sets have no rows.
struct WatersSet {
  std::uint32_t level = 0, set = 0;
  std::uint32_t tasks = 0;
  std::uint32_t chains = 0;  ///< Generated, with or without rows.
  bool schedulable_brueggen = false;
  bool schedulable_davis = false;  ///< Only meaningful if a method uses it.
  friend bool operator==(const WatersSet&, const WatersSet&) = default;
};

/// Results of the experiment.
struct WatersResult {
  std::vector<WatersSet> sets;
  std::vector<WatersRow> rows;
  friend bool operator==(const WatersResult&, const WatersResult&) = default;
};

/// Runs the experiment; ordered by level, set, chain.
WatersResult run_waters(const WatersOptions& options);

}  // namespace hotpath
