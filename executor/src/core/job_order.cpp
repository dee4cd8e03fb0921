// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/job_order.hpp"

#include <algorithm>
#include <utility>

namespace hotpath {

double similarity(const JobOrder& a, const JobOrder& b) {
  if (a.empty() && b.empty()) return 1;
  std::vector<std::uint32_t> above(b.size() + 1), row(b.size() + 1);
  for (const TaskId task : a) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      row[j + 1] = task == b[j] ? above[j] + 1 : std::max(above[j + 1], row[j]);
    }
    std::swap(above, row);
  }
  return 2.0 * above.back() / static_cast<double>(a.size() + b.size());
}

JobOrder by_period(JobOrder order, const TaskSet& set) {
  for (TaskId& id : order) {
    for (TaskId first = 0; first < id; ++first) {
      if (set[first].kind == set[id].kind && set[first].period == set[id].period) id = first;
    }
  }
  return order;
}

}  // namespace hotpath
