// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath::test {

using Random = std::mt19937_64;

std::int64_t draw(Random& random, std::int64_t least, std::int64_t most);
bool chance(Random& random, int percent);

/// The default mix of results/bounds/README.md: sensors, transforms, fusions in series, cyclic nodes,
/// intersections, commands; fan-out, fan-in, several publishers per topic, equal periods,
/// subscription priorities, depths, and platform costs in two of five graphs.
Graph random_graph(Random& random);

}  // namespace hotpath::test
