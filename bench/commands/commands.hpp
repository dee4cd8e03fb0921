// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

namespace hotpath::guarantees {
struct AnalyzeOptions;
}
namespace hotpath::live {
struct Options;
}
namespace hotpath::simulated {
struct Options;
}

namespace hotpath::commands {

/// Each function adds one subcommand, whose callback throws UsageError or RunError.
void add_run_command(CLI::App& app);
/// Calls `measure` in place of the measurement.
void add_run_command(CLI::App& app, const std::function<void(const live::Options&)>& measure);
void add_bench_command(CLI::App& app);
void add_doctor_command(CLI::App& app);

void add_simulate_command(CLI::App& app);
/// Calls `run` in place of the simulation.
void add_simulate_command(CLI::App& app, const std::function<void(const simulated::Options&)>& run);
/// All options of `simulate` except --no-trace and --output; `options` must outlive the parse.
void add_simulate_options(CLI::App& command, simulated::Options& options);
void add_analyze_command(CLI::App& app);
/// Calls `run` in place of the analysis.
void add_analyze_command(CLI::App& app, const std::function<void(const guarantees::AnalyzeOptions&)>& run);
void add_sweep_command(CLI::App& app);
void add_capacity_command(CLI::App& app);
void add_graph_command(CLI::App& app);
void add_list_command(CLI::App& app);

void add_import_command(CLI::App& app);
void add_advise_command(CLI::App& app);
void add_watch_command(CLI::App& app);

void add_explain_command(CLI::App& app);
void add_report_command(CLI::App& app);
void add_diff_command(CLI::App& app);
void add_replay_command(CLI::App& app);
void add_export_command(CLI::App& app);

void add_paper_command(CLI::App& app);
/// Hidden: what the Python package reads.
void add_feed_command(CLI::App& app);

/// `word`, where it is --executor or --deployment as --executors or --deployments.
[[nodiscard]] std::string plural(const std::string& word);

/// What is wrong with a command line that `app` refused because of a word it does not know, and what
/// to write instead: the new name of an old one, or the most similar one.
[[nodiscard]] std::string unknown_word(const CLI::App& app);

}  // namespace hotpath::commands
