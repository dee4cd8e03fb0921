// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>

#include "hotpath/analysis/waters_experiment.hpp"

namespace hotpath {

/// An estimate with its 95 % confidence interval.
struct ClusteredEstimate {
  double value = 0, low = 0, high = 0;
};

/// Normalised reductions (percent) of one utilisation and method. Chains of one task set are
/// similar; therefore all intervals are clustered by task set: linearised variance for mean and
/// share, Woodruff intervals for quantiles. All values are NaN without chains, and all intervals
/// with fewer than two task sets.
struct WatersSummary {
  double utilisation = 0;
  WatersMethod method = WatersMethod::brueggen_davare;
  std::uint32_t sets = 0, schedulable = 0, sets_with_chains = 0;
  std::uint64_t chains = 0;
  ClusteredEstimate schedulable_share;  ///< Wilson interval.
  ClusteredEstimate mean, median, p25, p75, positive_share;
  double deviation = 0, min = 0, max = 0;
  double p1 = 0, p5 = 0, p95 = 0, p99 = 0;
};

/// One summary per utilisation and method, in this order.
std::vector<WatersSummary> summarise_waters(const WatersOptions& options, const WatersResult& result);

/// One panel of the figure: equal bins over the panel's range of reductions (percent).
struct WatersHistogram {
  double utilisation = 0;
  WatersMethod method = WatersMethod::brueggen_davare;
  double low = 0, width = 0;
  std::vector<std::uint64_t> count;
};
/// One histogram per utilisation and method, in this order.
std::vector<WatersHistogram> waters_histograms(const WatersOptions& options, const WatersResult& result,
                                               std::size_t bins = 200);

/// Write one line per chain or bin, with header lines; reductions in percent.
void write_waters_csv(std::ostream& out, const WatersOptions& options, const WatersResult& result);
void write_waters_histogram_csv(std::ostream& out, const std::vector<WatersHistogram>& histograms);

}  // namespace hotpath
