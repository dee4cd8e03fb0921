// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath::results {

/// Two subscriptions of one topic whose samples arrived in another order than the graph's.
struct SwappedArrivals {
  TaskId stated_first = kNoTask, arrived_first = kNoTask;
  std::uint64_t messages = 0;  ///< Read by both.
  std::uint64_t swapped = 0;   ///< Of these, those that reached `arrived_first` first.
};

/// Compares the arrivals (Job::release) of each message at neighbours in the order of delivery. Of an
/// executor that polls, only arrivals before different polls can be told apart.
[[nodiscard]] std::vector<SwappedArrivals> swapped_arrivals(const GraphTasks& tasks, const Trace& trace);

}  // namespace hotpath::results
