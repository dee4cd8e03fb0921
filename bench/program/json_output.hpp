// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace hotpath::program {

// The option `--json` of commands that print tables: standard output gets one JSON document, the data
// behind the tables, and all other text goes to standard error, also that of child processes.

/// From now on, standard output is for show_json() alone. Throws RunError.
void reserve_output_for_json();

/// Prints the document if reserve_output_for_json() was called. Throws RunError.
void show_json(const nlohmann::json& document);

}  // namespace hotpath::program
