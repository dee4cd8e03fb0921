// SPDX-License-Identifier: Apache-2.0
#include <ostream>

#include "hotpath/analysis/waters_statistics.hpp"

namespace hotpath {

namespace {

std::ostream& operator<<(std::ostream& out, const ClusteredEstimate& e) {
  return out << e.value << ',' << e.low << ',' << e.high;
}

}  // namespace

void write_waters_csv(std::ostream& out, const WatersOptions& options, const WatersResult& result) {
  out << "utilisation,set,chain,length,default_ns";
  for (const WatersMethod m : options.methods)
    out << ',' << to_string(m) << "_ns," << to_string(m) << "_reduction_percent";
  out << '\n';
  for (const WatersRow& row : result.rows) {
    out << options.utilisations[row.level] << ',' << row.set << ',' << row.chain << ',' << row.length << ','
        << row.default_bound;
    for (std::size_t m = 0; m < options.methods.size(); ++m) {
      if (row.bound[m] < 0) {
        out << ",,";
      } else {
        out << ',' << row.bound[m] << ',' << 100 * row.reduction(m);
      }
    }
    out << '\n';
  }
}

void write_waters_summary_csv(std::ostream& out, const std::vector<WatersSummary>& summaries) {
  out << "utilisation,method,sets,schedulable,schedulable_share,schedulable_share_low,schedulable_share_high,"
         "sets_with_chains,chains,mean,mean_low,mean_high,median,median_low,median_high,p25,p25_low,p25_high,"
         "p75,p75_low,"
         "p75_high,positive_share,positive_share_low,positive_share_high,deviation,min,p1,p5,p95,p99,max\n";
  for (const WatersSummary& s : summaries) {
    out << s.utilisation << ',' << to_string(s.method) << ',' << s.sets << ',' << s.schedulable << ','
        << s.schedulable_share << ',' << s.sets_with_chains << ',' << s.chains << ',' << s.mean << ','
        << s.median << ',' << s.p25 << ',' << s.p75 << ',' << s.positive_share << ',' << s.deviation << ','
        << s.min << ',' << s.p1 << ',' << s.p5 << ',' << s.p95 << ',' << s.p99 << ',' << s.max << '\n';
  }
}

void write_waters_histogram_csv(std::ostream& out, const std::vector<WatersHistogram>& histograms) {
  out << "utilisation,method,low_percent,high_percent,chains\n";
  for (const WatersHistogram& h : histograms) {
    for (std::size_t i = 0; i < h.count.size(); ++i) {
      const double low = h.low + h.width * static_cast<double>(i);
      out << h.utilisation << ',' << to_string(h.method) << ',' << low << ',' << low + h.width << ','
          << h.count[i] << '\n';
    }
  }
}

}  // namespace hotpath
