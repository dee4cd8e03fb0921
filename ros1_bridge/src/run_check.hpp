// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <string>

namespace hotpath {

/// What makes a run unfit for drawing and indexing, such as an edge without a node or more nodes than any
/// graph has, in printable words; empty: nothing.
std::string run_defect(const telemetry::RunInfo& run);

/// Makes those of its texts printable that are shown to people. The others stay as they are, because samples
/// are found by them: run_id, topic_prefix and the edges' topics.
void make_printable(telemetry::RunInfo& run);

}  // namespace hotpath
