// SPDX-License-Identifier: Apache-2.0
#include <ostream>

#include "hotpath/analysis/waters_statistics.hpp"

namespace hotpath {

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
