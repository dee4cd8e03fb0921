// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Divides all periods, deadlines and given phases by `percent` / 100 (> 0), whole nanoseconds >= 1.
void scale_rates(Graph& graph, double percent);

/// Replicates all nodes and chains `copies` (>= 1) times, without connections between the copies.
/// From the second copy on, names and topics of the n-th copy end in `_n`. Throws
/// std::invalid_argument if a name becomes too long.
void make_copies(Graph& graph, unsigned copies);

}  // namespace hotpath
