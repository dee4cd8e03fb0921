// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "guarantees/analyze.hpp"
#include "live/live_run.hpp"
#include "simulated/simulated_run.hpp"

namespace hotpath::commands {

/// Each function adds one subcommand, whose callback throws UsageError or RunError.
void add_run_command(CLI::App& app);
void add_bench_command(CLI::App& app);
void add_doctor_command(CLI::App& app);

void add_simulate_command(CLI::App& app);
void add_analyze_command(CLI::App& app);
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

/// The command line of `run`.
struct RunOptions : live::Options {
  std::string against, junit, markdown;
};

/// The options of commands that a sweep or a search runs; `options` must outlive the parse.
void add_run_options(CLI::App& command, RunOptions& options);
void add_simulate_options(CLI::App& command, simulated::Options& options);
/// Those without --no-trace, --output and --json.
void add_simulation_options(CLI::App& command, simulated::Options& options);
/// Those without --contract.
void add_analyze_options(CLI::App& command, guarantees::AnalyzeOptions& options);

/// `word`, where it is --executor or --deployment as --executors or --deployments.
[[nodiscard]] std::string plural(const std::string& word);

/// What is wrong with a command line that `app` refused because of a word it does not know, and what
/// to write instead: the new name of an old one, or the most similar one.
[[nodiscard]] std::string unknown_word(const CLI::App& app);

}  // namespace hotpath::commands
