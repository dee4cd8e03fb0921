// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

#include "setup/common_options.hpp"

namespace hotpath {

/// The names of the options' groups in the help.
inline constexpr const char* kWhatRuns = "What runs";
inline constexpr const char* kHowLong = "How long";

/// Adds --graph, --load, --work, the phases, --rule and --ties; `options` must outlive the parse.
void add_graph_options(CLI::App& command, CommonOptions& options);

/// Adds --duration up to `longest_s`, --warm-up, --repetitions and --seed.
void add_length_options(CLI::App& command, CommonOptions& options, double longest_s);

void add_output_option(CLI::App& command, CommonOptions& options);

/// Executors of a command that takes several: `names` as given, none or `paper` as the paper's, `all`.
void add_executors_option(CLI::App& command, const std::string& option, CommonOptions& options);
[[nodiscard]] std::vector<std::string> executors_of(const std::vector<std::string>& names);

}  // namespace hotpath
