// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <nlohmann/json_fwd.hpp>

#include "hotpath/tracing/ctf_trace.hpp"
#include "import/stages.hpp"

namespace hotpath::imports {

/// The results of an import.
struct Facts {
  const tracing::TraceReading& reading;
  const tracing::System& system;  ///< Of the whole trace.
  const Imported& imported;
  const CtfOptions& options;
  std::uint64_t later_jobs;  ///< Jobs after those used for rules and times.

  [[nodiscard]] std::uint64_t jobs() const { return imported.recorded.jobs.size() + later_jobs; }
};

/// The comments of graph.yaml.
[[nodiscard]] GraphComments import_comments(const Imported& imported);
/// The content of import.json; keys end with their units.
[[nodiscard]] nlohmann::json import_json(const Facts& facts);

/// Prints the summary of the import.
void print_import(std::ostream& out, const Facts& facts, const std::filesystem::path& output);

}  // namespace hotpath::imports
