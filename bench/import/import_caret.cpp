// SPDX-License-Identifier: Apache-2.0
#include "import/import_caret.hpp"

#include <filesystem>

#include "hotpath/core/utf8.hpp"
#include "hotpath/core/worker.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "program/output_target.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

void import_caret(const CaretOptions& options) {
  if (!options.output.empty()) program::check_output_folder(options.output);
  const CaretArchitecture architecture = read_caret_architecture(options.file);
  std::map<std::string, CaretStats> stats;
  if (!options.stats.empty()) stats = read_caret_stats(options.stats);
  ImportedGraph imported = graph_of(architecture, stats);
  const std::filesystem::path file = std::filesystem::absolute(options.file);
  imported.comments.header = "Made by `hotpath import caret` of " + file.filename().string() + ".";
  if (options.cores > 0) {
    imported.graph.platform.cores = options.cores;
  } else {
    imported.missing.push_back("the number of processors; add --cores N.");
  }
  const std::string name = file.parent_path().filename();
  imported.graph.name = imported.deployment.name =
      printable(name.empty() ? "caret" : graph_node_name(name), kMaxNameBytes);
  const std::string output = options.output.empty() ? "imports/" + imported.graph.name : options.output;
  write_import(std::move(imported), output);
}

}  // namespace hotpath::imports
