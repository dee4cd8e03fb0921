// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "import/recognition.hpp"

namespace hotpath::imports {

/// One or two sentences: the verdict, its evidence, and what would decide an open one.
[[nodiscard]] std::string sentence(const Recognition& recognition, const RecordedGraph& graph);

/// Verdict, names, and the ranking with scores.
[[nodiscard]] nlohmann::json recognition_json(const Recognition& recognition, const RecordedGraph& graph);

}  // namespace hotpath::imports
