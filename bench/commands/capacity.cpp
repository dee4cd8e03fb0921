// SPDX-License-Identifier: Apache-2.0
#include "commands/capacity_search.hpp"
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "program/errors.hpp"

namespace hotpath {

namespace {

/// The words for `run` of what was given here; refuses what only a simulation has.
std::vector<std::string> words_for_run(const CLI::App& capacity, Over over) {
  CLI::App app;
  add_run_command(app);
  const CLI::App* const run = app.get_subcommand("run");
  const std::vector<std::string> mine = {
      to_string(over), "over",     "require",      "from",   "to",        "resolution",
      "coarse",        "live",     "live-options", "output", "executors", "deployments",
      "threads",       "duration", "repetitions",  "phases"};
  std::vector<std::string> words = given_options(capacity, mine);
  for (const std::string& word : words) {
    const std::string option = word.substr(0, word.find('='));
    if (run->get_option_no_throw(option) == nullptr) {
      throw UsageError(option + " is of simulations; leave it out with --live");
    }
  }
  return words;
}

}  // namespace

void add_capacity_command(CLI::App& app) {
  auto command = std::make_shared<const CLI::App*>();
  auto [capacity, o] = add_command<CapacityOptions>(
      app, "capacity", "The highest load, rate or number of chains that each executor carries",
      "hotpath capacity --over load --executors default,rm-ro --repetitions 20",
      [command](CapacityOptions options) {
        options.executors = executors_of(options);
        if (options.live) options.run_words = words_for_run(**command, options.over);
        search_capacities(options);
      });
  *command = &capacity;
  o.duration_s = 10;
  o.repetitions = 20;
  o.phases = Phases::random;
  capacity.option_defaults()->group("What is searched");
  add_choice(capacity, "--over", o.over,
             "What grows: work of the nodes in percent of a core, rate of\nthe timers in percent, or copies "
             "of the graph");
  capacity
      .add_option("--require", o.require,
                  "What must hold in every repetition: no-loss, deadlines,\nlatency:MS (the hot path's "
                  "largest), with commas between")
      ->type_name("WORDS")
      ->delimiter(',')
      ->capture_default_str();
  add_number(capacity, "--from", o.from, {0, 1e6}, "LEVEL", "Lowest level");
  add_number(capacity, "--to", o.to, {0, 1e6}, "LEVEL", "Highest level");
  add_number(capacity, "--resolution", o.resolution, {1e-3, 1e6}, "LEVEL",
             "Distance of two levels that are told apart");
  add_number(capacity, "--coarse", o.coarse, {2, 10000}, "N",
             "Levels tried first, to find where it holds, fails and\nholds again");
  capacity.add_flag("--live", o.live, "Measure instead of simulating");
  add_text(capacity, "--live-options", o.live_options, "OPTIONS",
           "With --live: more options of `hotpath run`");
  add_simulate_options(capacity, o);
  add_output_option(capacity, o);
}

}  // namespace hotpath
