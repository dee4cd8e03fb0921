// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/tightness.hpp"

#include "hotpath/analysis/analysis_error.hpp"

namespace hotpath {

TightnessReport compare_with_bounds(const std::vector<BoundAndObservation>& pairs) {
  TightnessReport report;
  for (const BoundAndObservation& pair : pairs) {
    if (pair.bound && *pair.bound <= 0) {
      throw AnalysisError("the bound of '" + pair.name + "', " + std::to_string(*pair.bound) +
                          " ns, is not positive");
    }
    Tightness row{pair.name, pair.bound, pair.observed, std::nullopt, false};
    if (pair.bound && pair.observed) {
      row.ratio = static_cast<double>(*pair.observed) / static_cast<double>(*pair.bound);
      row.violated = *pair.observed > *pair.bound;
      report.violations += row.violated;
    }
    report.rows.push_back(std::move(row));
  }
  return report;
}

}  // namespace hotpath
