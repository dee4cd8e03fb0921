// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Divides all periods, deadlines and given phases by `percent` / 100 (> 0), whole nanoseconds >= 1.
void scale_rates(Graph& graph, double percent);

/// `copies` (>= 1) of all nodes and chains beside each other, without any connection; names and topics of the
/// n-th, from the second on, end in `_n`. Throws std::invalid_argument where a name becomes too long.
void make_copies(Graph& graph, unsigned copies);

}  // namespace hotpath
