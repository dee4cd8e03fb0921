// SPDX-License-Identifier: Apache-2.0
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "simulated/simulated_run.hpp"

namespace hotpath {

namespace {

/// Beyond it instants in nanoseconds would overflow.
constexpr double kLongestSimulation_s = 1e9;

}  // namespace

void add_simulate_command(CLI::App& app) { add_simulate_command(app, run_simulated); }

void add_simulate_command(CLI::App& app, const std::function<void(const SimulateOptions&)>& run) {
  auto [simulate, o] = add_command<SimulateOptions>(
      app, "simulate", "Run a graph under executors in virtual time: exact, repeatable, fast",
      "hotpath simulate --executors all --duration 600 --output runs/simulated",
      [run](SimulateOptions options) {
        options.executors = executors_of(options);
        run(options);
      });
  o.duration_s = 60;
  add_simulate_options(simulate, o);
  simulate
      .add_flag("--no-trace", o.no_trace,
                "Keep no jobs: no jobs.csv, no quantiles of response\ntimes, and memory that hardly grows "
                "with time")
      ->group("Results");
  add_output_option(simulate, o);
}

void add_simulate_options(CLI::App& simulate, SimulateOptions& o) {
  add_executors_option(simulate, "--executors,--executor", o);
  add_graph_options(simulate, o);
  add_text(simulate, "--phases-of", o.phases_of, "RUN",
           "First timestamps of the same executor and repetition of\na run, from its folder");
  exclude(simulate, "--phases-of", {"--phases", "--phases-file", "--phase-step"});
  add_length_options(simulate, o, kLongestSimulation_s);
  add_number(
      simulate, "--max-backlog", o.max_backlog, {1, 1e9}, "JOBS",
      "Released jobs that may wait before the system counts as\noverloaded; by default 100 for each task");
  add_platform_options(simulate, o);
  add_text(simulate, "--execution-times", o.execution_times, "worst|uniform|measured|replayed|replay:RUN",
           "worst: as the graph says; uniform: between best and worst\n"
           "case, at random; measured: drawn from measured values that\n"
           "the graph gives, else uniform; replayed: these in the order\n"
           "in which they were measured; replay:RUN: as measured by a\n"
           "run of the same executors on the same graph, from its folder");
  add_number(simulate, "--threads", o.threads, {0, 1024}, "N",
             "Simulations at the same time, 0 for one per processor;\nresults do not depend on it")
      ->group("Results");
}

}  // namespace hotpath
