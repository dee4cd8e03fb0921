// SPDX-License-Identifier: Apache-2.0
#include "commands/command.hpp"

namespace hotpath::commands {

namespace {

/// Longer simulations would overflow time points in nanoseconds.
constexpr double kLongestSimulation_s = 1e9;

}  // namespace

void add_simulate_options(CLI::App& simulate, simulated::Options& o) {
  o.duration_s = 60;
  add_simulation_options(simulate, o);
  add(simulate, "--no-trace", o.no_trace,
      "Store no jobs: no jobs.csv and no quantiles of response times, but nearly constant memory")
      ->group("Results");
  add_output_option(simulate, o);
  add_json_option(simulate);
}

void add_simulation_options(CLI::App& simulate, simulated::Options& o) {
  add_executors_option(simulate, o);
  add_graph_options(simulate, o);
  add_length_options(simulate, o, kLongestSimulation_s);
  add(simulate, "--max-backlog", o.max_backlog, {1, 1e9}, "JOBS",
      "Queued jobs above which the system counts as overloaded; by default 100 per task");
  add_platform_options(simulate, o);
  const auto source = [](const std::string& text) {
    if (const auto times = setup::TimesSource::parse(text)) return *times;
    throw UsageError("--execution-times: `" + text + "` is not " + joined(words<ExecutionTimeModel>()) +
                     ", replay:RUN or listed:FILE");
  };
  add_parsed(simulate, "--execution-times", o.execution_times, source,
             joined(words<ExecutionTimeModel>(), "|") + "|replay:RUN|listed:FILE",
             "worst: the graph's worst case; uniform: random between best\n"
             "and worst case; measured: random among the graph's measured\n"
             "values, otherwise uniform; replayed: the measured values in\n"
             "recorded order; replay:RUN: the times of a stored run of the\n"
             "same executors and graph; listed:FILE: a CSV file with columns\n"
             "task,sequence,execution_time_ns, and release_delay_ns for\n"
             "timers with jitter; by default as in the graph");
  add_threads_option(simulate, o.threads)->group("Results");
}

const Command kSimulate("Predict", 40, [](CLI::App& app) {
  auto [simulate, o] = add_command<simulated::Options>(
      app, "simulate", "Simulate a graph under several executors in deterministic virtual time",
      "hotpath simulate autoware --cores 2 --set FrontLidarDriver.period_ms=50",
      [](simulated::Options options) {
        options.executors = executors_of(options);
        simulated::run_simulated(options);
      });
  add_simulate_options(simulate, o);
  show_first(simulate, {"--executors", "--set", "--cores", "--duration", "--output", "--json"});
});

}  // namespace hotpath::commands
