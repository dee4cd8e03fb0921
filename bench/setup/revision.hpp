// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hotpath::setup {

/// The revision of the sources, as `git describe --always --dirty` named it at the last commit or
/// configuration; empty: they were not built in a clone.
extern const char* const kRevision;

}  // namespace hotpath::setup
