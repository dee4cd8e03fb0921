// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace hotpath::program {

// The option `--json` of commands that print tables: standard output gets one JSON document, the data
// behind the tables, and all other text goes to standard error, also that of child processes.

/// From now on, standard output is for show_json() alone. Throws RunError.
void reserve_output_for_json();
[[nodiscard]] bool prints_json();

/// Prints the document if reserve_output_for_json() was called. Throws RunError.
void show_json(const nlohmann::json& document);
/// The same for the rows of a CSV text with a header: an object for each, whose values are numbers
/// where a field is one, and null for an empty field.
void show_rows(const std::string& csv);

}  // namespace hotpath::program
