// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <cstdint>
#include <string>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// What the graph says of a run: its nodes with a layout, their connections and chains. The rest is the
/// caller's.
telemetry::RunInfo make_run_info(const Graph& graph);

/// Tells repetitions apart, also those of runs at the same time.
std::string make_run_id(std::int64_t epoch_ns, const std::string& executor, std::uint32_t repetition);

}  // namespace hotpath
