// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/teper_2022.hpp"

#include <string>

#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/analysis/exact.hpp"

namespace hotpath {

std::int64_t teper_2022(std::int64_t total_wcet, const std::vector<Rtss2022Element>& chain) {
  using exact::add, exact::multiply, exact::subtract;
  const auto refuse = [](const std::string& problem) {
    throw AnalysisError("the RTSS 2022 bound (teper_2022): " + problem);
  };
  if (chain.empty()) refuse("the chain is empty");
  if (total_wcet <= 0) refuse("total execution time " + std::to_string(total_wcet) + " ns is not positive");
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const Rtss2022Element& e = chain[i];
    if (e.kind == Rtss2022Element::Kind::subscription) {
      sum = add(sum, total_wcet);
      continue;
    }
    if (e.period <= 0 || e.wcet < 0) {
      refuse("element " + std::to_string(i + 1) + " of the chain: the period of " + std::to_string(e.period) +
             " ns must be positive and the execution time of " + std::to_string(e.wcet) +
             " ns must not be negative");
    }
    if (e.wcet > e.period) {
      refuse("element " + std::to_string(i + 1) + " of the chain: execution time " + std::to_string(e.wcet) +
             " ns exceeds the period " + std::to_string(e.period) + " ns; teper_2024 accepts such timers");
    }
    const auto windows =
        2 + (e.kind == Rtss2022Element::Kind::passive_trigger ? std::int64_t{e.distance} : 0);
    sum = add(sum, add(subtract(e.period, e.wcet), multiply(windows, total_wcet)));
  }
  return sum;
}

}  // namespace hotpath
