// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/graph_bounds.hpp"

namespace hotpath {

/// The bounds of several threads of one executor, each with a core. Throws AnalysisError for other systems.
void bound_threads(const BoundedSystem& system, GraphBounds& out);

}  // namespace hotpath
