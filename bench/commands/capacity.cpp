// SPDX-License-Identifier: Apache-2.0
#include "commands/capacity_search.hpp"
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "program/errors.hpp"

namespace hotpath {

namespace {

struct CapacityArguments {
  CapacityOptions options;
  std::string live_options;
};

/// An option as words_for_run() has it, without its value.
std::string name_of(const std::string& word) { return word.substr(0, word.find('=')); }

/// Reads --live-options as `run` would, and refuses what capacity decides or is to be told itself.
std::vector<std::string> more_words_for_run(const CLI::App& capacity, CLI::App& run, std::string text) {
  // The command's own callback keeps its options alive, and must not run.
  run.parse_complete_callback([] { throw CLI::Success(); });
  try {
    run.parse(std::move(text), false);
  } catch (const CLI::Success&) {
  } catch (const CLI::ParseError& error) {
    throw UsageError(concat("--live-options: ", error.what(), "; see `hotpath run --help`"));
  }
  std::vector<std::string> words = given_options(run, {});
  for (const std::string& word : words) {
    if (name_of(word) != "--executor" && capacity.get_option_no_throw(name_of(word)) == nullptr) continue;
    throw UsageError("--live-options: " + name_of(word) + " is an option of capacity itself");
  }
  return words;
}

/// The words for `run` of what was given here; refuses what only a simulation has.
std::vector<std::string> words_for_run(const CLI::App& capacity, const CapacityArguments& a) {
  CLI::App app;
  add_run_command(app);
  CLI::App& run = *app.get_subcommand("run");
  const std::vector<std::string> mine = {
      "over",     "require",      "from",   "to",        "resolution",  "coarse",     "live",
      "duration", "live-options", "output", "executors", "deployments", "repetitions"};
  std::vector<std::string> words = given_options(capacity, mine);
  for (const std::string& word : words) {
    if (run.get_option_no_throw(name_of(word)) == nullptr) {
      throw UsageError(name_of(word) + " is of simulations; leave it out with --live");
    }
  }
  if (capacity.count("--phases") + capacity.count("--phases-file") == 0) {
    words.push_back(concat("--phases=", to_string(a.options.phases)));
  }
  const std::vector<std::string> more = more_words_for_run(capacity, run, a.live_options);
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

}  // namespace

void add_capacity_command(CLI::App& app) {
  auto command = std::make_shared<const CLI::App*>();
  auto [capacity, arguments] = add_command<CapacityArguments>(
      app, "capacity", "The highest load, rate or number of chains that each executor carries",
      "hotpath capacity --over load --executors default,rm-ro --repetitions 20",
      [command](CapacityArguments a) {
        CapacityOptions& options = a.options;
        options.executors = executors_of(options);
        const std::string level = concat("--", to_string(options.over));
        if ((*command)->count(level) > 0)
          throw UsageError(level + " grows from level to level (--over); leave it out");
        if (options.live) options.run_words = words_for_run(**command, a);
        search_capacities(options);
      });
  *command = &capacity;
  CapacityOptions& o = arguments.options;
  o.duration_s = 10;
  o.repetitions = 20;
  o.phases = Phases::random;
  capacity.option_defaults()->group("What is searched");
  add_choice(capacity, "--over", o.over,
             "What grows: work of the nodes in percent of a core, rate of\nthe timers in percent, or copies "
             "of the graph");
  add_list(
      capacity, "--require", o.require, "WORDS",
      "What must hold in every repetition: no-loss, deadlines,\nlatency:MS (the hot path's largest), with "
      "commas between");
  add_number(capacity, "--from", o.from, {0, 1e6}, "LEVEL", "Lowest level");
  add_number(capacity, "--to", o.to, {0, 1e6}, "LEVEL", "Highest level");
  add_number(capacity, "--resolution", o.resolution, {1e-3, 1e6}, "LEVEL",
             "Distance of two levels that are told apart");
  add_number(capacity, "--coarse", o.coarse, {2, 10000}, "N",
             "Levels tried first, to find where it holds, fails and\nholds again");
  CLI::Option* const live = capacity.add_flag("--live", o.live, "Measure instead of simulating");
  add_text(capacity, "--live-options", arguments.live_options, "OPTIONS", "More options of `hotpath run`")
      ->needs(live);
  add_simulate_options(capacity, o);
  capacity.get_option("--work")->needs(live);
  add_output_option(capacity, o);
}

}  // namespace hotpath
