// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <initializer_list>

#include "hotpath/analysis/graph_bounds.hpp"
#include "hotpath/analysis/graph_busy_window.hpp"
#include "hotpath/analysis/release_overhead.hpp"

namespace hotpath {

constexpr std::uint32_t bits(std::initializer_list<Assumption> all) {
  std::uint32_t sum = 0;
  for (const Assumption a : all) sum |= static_cast<std::uint32_t>(a);
  return sum;
}

/// Why a method does not apply that leaves `missing`.
std::string not_covered(std::uint32_t missing);

/// What `bound` fills in; nothing but the reason where something is missing or it throws AnalysisError.
GraphBounds attempt(const char* method, std::uint32_t missing,
                    const std::function<void(GraphBounds&)>& bound);

/// Ranks of the paper's priority order (priority, then subscriptions before timers, then timers by task).
/// Under policies without fixed priorities all levels are equal.
GraphOrder priority_ranks(const BoundedSystem& system);

/// `analysis` on a system of timers alone, with what dispatches and releases cost. Throws AnalysisError.
OverheadAwareResponse timer_responses(const BoundedSystem& system, const ResponseTimeAnalysis& analysis);

}  // namespace hotpath
