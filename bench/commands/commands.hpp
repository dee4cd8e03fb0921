// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "guarantees/analyze.hpp"
#include "live/live_run.hpp"
#include "simulated/simulated_run.hpp"

namespace hotpath::commands {

/// A command. Each is one file, which has one of these. `adds` adds the subcommand, whose callback throws
/// UsageError or RunError. `group` and `place`: in the help; an empty group hides it.
struct Command {
  Command(const std::string& group, int place, void (*adds)(CLI::App& app));
};

/// Writes the pages of --help and --help-all.
[[nodiscard]] std::shared_ptr<CLI::FormatterBase> help_formatter();

/// Adds all commands in the order of their places.
void add_commands(CLI::App& app);

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

/// Adds `paper threads`.
void add_paper_threads(CLI::App& paper);

/// `word`, where it is --executor or --deployment as --executors or --deployments.
[[nodiscard]] std::string plural(const std::string& word);

/// What is wrong with a command line that `app` refused because of a word it does not know, and what
/// to write instead: the most similar one.
[[nodiscard]] std::string unknown_word(const CLI::App& app);

}  // namespace hotpath::commands
