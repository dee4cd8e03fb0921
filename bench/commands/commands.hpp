// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

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
void add_compare_command(CLI::App& app);
void add_simulate_command(CLI::App& app);
/// Calls `run` in place of the simulation.
void add_simulate_command(CLI::App& app, const std::function<void(const simulated::Options&)>& run);
/// All options of `simulate` except --no-trace and --output; `options` must outlive the parse.
void add_simulate_options(CLI::App& command, simulated::Options& options);
void add_sweep_command(CLI::App& app);
void add_capacity_command(CLI::App& app);
void add_timeline_command(CLI::App& app);
void add_replay_command(CLI::App& app);
void add_validate_command(CLI::App& app);
void add_list_command(CLI::App& app);
void add_graph_command(CLI::App& app);
void add_analyze_command(CLI::App& app);
/// Calls `run` in place of the analysis.
void add_analyze_command(CLI::App& app, const std::function<void(const guarantees::AnalyzeOptions&)>& run);
void add_advise_command(CLI::App& app);
void add_experiment_command(CLI::App& app);
void add_explain_command(CLI::App& app);
void add_machine_command(CLI::App& app);
void add_bench_command(CLI::App& app);
void add_summarize_command(CLI::App& app);
void add_check_command(CLI::App& app);
void add_recover_command(CLI::App& app);
void add_report_command(CLI::App& app);
void add_compare_results_command(CLI::App& app);
void add_import_command(CLI::App& app);
void add_export_command(CLI::App& app);
void add_watch_command(CLI::App& app);
/// To be added last: it knows the commands of `app` when it runs.
void add_completion_command(CLI::App& app);

}  // namespace hotpath::commands
