// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace hotpath::test {

/// Counts of refused graphs and ratios of bounds to observations, over all threads.
class SearchStatistics {
 public:
  /// `executor` was asked for bounds of a graph.
  void asked(const std::string& executor, bool refused);
  /// `ratio`: of a bound to the largest observation.
  void pessimism(const std::string& method, double ratio);
  std::string report();

 private:
  std::mutex mutex_;
  std::map<std::string, std::pair<std::size_t, std::size_t>> pairs_;  ///< By executor: asked, refused.
  std::map<std::string, std::vector<float>> ratios_;                  ///< By method.
};

/// Those of this process.
SearchStatistics& search_statistics();

}  // namespace hotpath::test
