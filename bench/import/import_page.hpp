// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <nlohmann/json_fwd.hpp>

#include "import/interpretation.hpp"
#include "import/trace_events.hpp"

namespace hotpath {

/// All that an import found out.
struct ImportFacts {
  const TraceReading& reading;
  const Recording& recording;
  const Interpretations& interpretations;
  std::uint64_t later_jobs;  ///< After those from which rules and times are.
  const std::string& trace;
};

/// What graph.yaml says in comments.
[[nodiscard]] GraphComments import_comments(const Recording& recording, const Interpretation& best);

/// The content of import.json; units are the endings of keys.
[[nodiscard]] nlohmann::json import_json(const ImportFacts& facts);

/// What the command prints.
void tell_import(std::ostream& out, const ImportFacts& facts, const std::filesystem::path& output);

}  // namespace hotpath
