// SPDX-License-Identifier: Apache-2.0
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "program/errors.hpp"
#include "sweep/capacity_search.hpp"

namespace hotpath::commands {

namespace {

struct CapacityArguments : sweep::CapacityOptions {
  std::string live_options;
};

/// The option of a word of words_for_run(), without its value.
std::string name_of(const std::string& word) { return word.substr(0, word.find('=')); }

/// Parses --live-options like `run`, and rejects options that capacity sets or has itself.
std::vector<std::string> more_words_for_run(const CLI::App& capacity, CLI::App& run, std::string text) {
  try {
    run.parse(std::move(text), false);
  } catch (const CLI::ParseError& error) {
    throw program::UsageError(
        program::concat("--live-options: ", error.what(), "; see `hotpath run --help`"));
  }
  std::vector<std::string> words = given_options(run, {});
  for (const std::string& word : words) {
    if (capacity.get_option_no_throw(name_of(word)) == nullptr) continue;
    throw program::UsageError("--live-options: " + name_of(word) + " is an option of capacity itself");
  }
  return words;
}

/// The given options as words for `run`; rejects options for simulations only.
std::vector<std::string> words_for_run(const CLI::App& capacity, const CapacityArguments& a) {
  CLI::App run;
  RunOptions unused;
  add_run_options(run, unused);
  const std::vector<std::string> own = {"over",        "require",     "from",         "to",     "resolution",
                                        "live",        "duration",    "live-options", "output", "executors",
                                        "deployments", "repetitions", "json"};
  std::vector<std::string> words = given_options(capacity, own);
  for (const std::string& word : words) {
    if (run.get_option_no_throw(name_of(word)) == nullptr) {
      throw program::UsageError(name_of(word) + " applies to simulations only; leave it out with --live");
    }
  }
  if (capacity.count("--phases") == 0) {
    words.push_back(program::concat("--phases=", to_string(a.phases)));
  }
  const std::vector<std::string> live_words = more_words_for_run(capacity, run, a.live_options);
  words.insert(words.end(), live_words.begin(), live_words.end());
  return words;
}

}  // namespace

void add_capacity_command(CLI::App& app) {
  auto [capacity, o] = add_command<CapacityArguments>(
      app, "capacity", "Find the highest load, rate or number of copies that executors sustain",
      "hotpath capacity --over load --executors default,rm-ro --repetitions 20",
      [](const CLI::App& command, CapacityArguments& options) {
        options.executors = executors_of(options);
        const std::string level = program::concat("--", to_string(options.over));
        if (command.count(level) > 0)
          throw program::UsageError(level + " is the searched quantity (--over); leave it out");
        if (options.live) options.run_words = words_for_run(command, options);
        sweep::search_capacities(options);
      });
  o.duration_s = 10;
  o.repetitions = 20;
  o.phases = Phases::random;
  capacity.option_defaults()->group("Search");
  add_choice(capacity, "--over", o.over,
             "Quantity to search: load in percent of one core, timer rate\n"
             "in percent, or number of graph copies");
  add_list(capacity, "--require", o.require, "CONDITIONS",
           "Conditions for every repetition, separated by commas:\n"
           "no-loss, deadlines, latency:MS (limit of the hot path)");
  add_number(capacity, "--from", o.from, {0, 1e6}, "LEVEL", "Lowest level");
  add_number(capacity, "--to", o.to, {0, 1e6}, "LEVEL", "Highest level");
  add_number(capacity, "--resolution", o.resolution, {1e-3, 1e6}, "LEVEL", "Search step between two levels");
  CLI::Option* const live = capacity.add_flag("--live", o.live, "Measure live instead of simulating");
  add_text(capacity, "--live-options", o.live_options, "OPTIONS", "Further options of `hotpath run`")
      ->needs(live);
  add_simulation_options(capacity, o);
  capacity.get_option("--work")->needs(live);
  add_output_option(capacity, o, "runs/DATE-capacity");
  add_json_option(capacity);
}

const Command kCapacity("Predict", 70, add_capacity_command);

}  // namespace hotpath::commands
