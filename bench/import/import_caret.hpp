// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "import/caret_files.hpp"
#include "import/imported_graph.hpp"

namespace hotpath {

/// What `hotpath import caret` is told on the command line.
struct ImportCaretOptions {
  std::string file;    ///< architecture.yaml.
  std::string stats;   ///< Folder of stats_node files; empty: periods and execution times are not known.
  std::string output;  ///< New folder.
  unsigned cores = 0;  ///< Processors of the recorded machine; 0: not told.
};

/// Throws InputError with file and line for what CARET would not write.
void import_caret(const ImportCaretOptions& options);

/// The graph that CARET saw. `stats` may be empty. Where CARET does not tell which callback publishes a topic
/// that somebody subscribes to, it is the callback whose frequency fits that of the subscribers best, and of
/// equals the one on a named path, then the one that works longest; where nobody known publishes it, a timer
/// of node `external` does at the frequency measured.
[[nodiscard]] ImportedGraph graph_of(const CaretArchitecture& architecture,
                                     const std::map<std::string, CaretStats>& stats);

}  // namespace hotpath
