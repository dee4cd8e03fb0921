// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

/// The work that a growing set of tasks can release. Tasks of equal period and jitter are combined:
/// task sets have few distinct periods (WATERS: nine), so an evaluation needs few divisions for any
/// number of tasks.
class Interference {
 public:
  void add(std::int64_t wcet, std::int64_t period, std::int64_t jitter) {
    once_ = exact::add(once_, wcet);
    for (Group& g : groups_) {
      if (g.period == period && g.jitter == jitter) {
        g.wcet += wcet;  // at most once_
        return;
      }
    }
    groups_.push_back({period, jitter, wcet});
  }

  bool has_jitter() const {
    return std::any_of(groups_.begin(), groups_.end(), [](const Group& g) { return g.jitter > 0; });
  }

  /// One job of each task.
  std::int64_t once() const { return once_; }

  /// Work of the jobs released in [0, t): ceil((t + J) / T) jobs each.
  std::int64_t before(std::int64_t t) const {
    std::int64_t sum = 0;
    for (const Group& g : groups_) {
      sum = exact::add(sum, exact::multiply(exact::ceil_div(exact::add(t, g.jitter), g.period), g.wcet));
    }
    return sum;
  }

  /// Work of the jobs released in [0, t]: floor((t + J) / T) + 1 jobs each.
  std::int64_t through(std::int64_t t) const {
    std::int64_t sum = 0;
    for (const Group& g : groups_) {
      sum = exact::add(sum, exact::multiply(exact::floor_div(exact::add(t, g.jitter), g.period) + 1, g.wcet));
    }
    return sum;
  }

 private:
  struct Group {
    std::int64_t period, jitter, wcet;
  };
  std::vector<Group> groups_;
  std::int64_t once_ = 0;
};

}  // namespace hotpath
