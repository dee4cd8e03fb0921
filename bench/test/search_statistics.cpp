// SPDX-License-Identifier: Apache-2.0
#include "search_statistics.hpp"

#include <algorithm>

#include "program/text.hpp"

namespace hotpath::test {

void SearchStatistics::asked(const std::string& executor, bool refused) {
  const std::lock_guard lock(mutex_);
  auto& [asked, none] = pairs_[executor];
  ++asked;
  none += refused;
}

void SearchStatistics::pessimism(const std::string& method, double ratio) {
  const std::lock_guard lock(mutex_);
  std::vector<float>& all = ratios_[method];
  if (all.size() < 1'000'000) all.push_back(static_cast<float>(ratio));
}

std::string SearchStatistics::report() {
  const std::lock_guard lock(mutex_);
  std::string out = "refused, of all graphs:\n";
  for (const auto& [executor, counts] : pairs_) {
    out += program::text("  %-18s %5.1f %% of %zu\n", executor.c_str(),
                         100.0 * static_cast<double>(counts.second) / static_cast<double>(counts.first),
                         counts.first);
  }
  out += "bound / largest observed, median:\n";
  for (auto& [method, all] : ratios_) {
    std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
    out += program::text("  %-45s %.2f of %zu\n", method.c_str(), all[all.size() / 2], all.size());
  }
  return out;
}

SearchStatistics& search_statistics() {
  static SearchStatistics all;
  return all;
}

}  // namespace hotpath::test
