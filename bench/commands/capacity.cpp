// SPDX-License-Identifier: Apache-2.0
#include "sweep/capacity.hpp"
#include "commands/command.hpp"

namespace hotpath::commands {

const Command kCapacity("Predict", 70, [](CLI::App& app) {
  auto [capacity, o] = add_command<sweep::CapacityOptions>(
      app, "capacity", "Find the highest load, rate or number of copies that executors sustain",
      "hotpath capacity --over load --executors default,rm-ro --repetitions 20",
      [](const CLI::App& command, sweep::CapacityOptions& options) {
        options.executors = executors_of(options);
        const std::string level = concat("--", to_string(options.over));
        if (command.count(level) > 0)
          throw UsageError(level + " is the searched quantity (--over); leave it out");
        sweep::search_capacities(options);
      });
  o.duration_s = 10;
  o.repetitions = 20;
  o.phases = Phases::random;
  capacity.option_defaults()->group("Search");
  add(capacity, "--over", o.over,
      "Quantity to search: load in percent of one core, timer rate in percent, or number of graph copies");
  const auto require = [&o = o](const auto& words) { o.require = sweep::Requirement::parse(words); };
  add_list(capacity, "--require", require, "CONDITIONS",
           "Conditions for every repetition, separated by commas: no-loss, deadlines, age:MS (limit of the "
           "age of each output's data), latency:MS (of the hot path, the paper's metric)")
      ->default_str(joined(o.require.words, ","));
  add(capacity, "--from", o.from, {0, 1e6}, "LEVEL", "Lowest level");
  add(capacity, "--to", o.to, {0, 1e6}, "LEVEL", "Highest level");
  add(capacity, "--resolution", o.resolution, {1e-3, 1e6}, "LEVEL", "Search step between two levels");
  add_simulation_options(capacity, o);
  capacity.remove_option(capacity.get_option("--work"));  // for live runs only
  add_output_option(capacity, o, "runs/DATE-capacity");
  add_json_option(capacity);
  show_first(capacity, {"--over", "--require", "--executors", "--set", "--cores", "--output"});
});

}  // namespace hotpath::commands
