// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "graph_source.hpp"
#include "hotpath/reference_system/yaml_value.hpp"

namespace hotpath {

/// Limit of a subscription's history depth.
inline constexpr std::int64_t kMaxDepth = 1000;

/// Reads groups, callbacks, inputs and outputs of a node of type `callbacks` from its map in `file`. Throws
/// InputError.
void parse_callbacks(const YamlMap& map, const std::string& file, Node& node, NodeLines& lines);

/// The key `release_jitter_ms` of a timer. Throws InputError unless it is below the period.
[[nodiscard]] Duration parse_release_jitter(const YamlMap& timer, Duration period);

}  // namespace hotpath
