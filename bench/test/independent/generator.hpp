// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace independent {

/// Writes a random graph file that hotpath accepts: several timers per node, fusions, cyclic nodes
/// with feedback, `every: N`, `last_of`, long pipelines, several sinks, depths above 1, topics with
/// several publishers. Hyperperiods are at most 600 ms. The same seed gives the same file.
/// For several `threads`, small graphs with times of some nanoseconds, and loads above one.
void write_random_graph(std::uint64_t seed, const std::string& file, std::size_t threads = 1);

}  // namespace independent
