// SPDX-License-Identifier: Apache-2.0
#include "commands/option_helpers.hpp"

#include <algorithm>

#include "program/output_target.hpp"

namespace hotpath {

namespace {

constexpr double kLargestCost_us = 1e9;

/// release_cost_us -> --release-cost-us
std::string option_name(std::string_view key) {
  std::string name = "--" + std::string(key);
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

}  // namespace

CLI::Validator not_empty() {
  const auto check = [](const std::string& text) {
    return std::string(text.empty() ? "an empty name; leave the option out, or name something" : "");
  };
  return CLI::Validator(check, "");
}

CLI::Option* add_output_file(CLI::App& command, const std::string& option, std::string& file,
                             const std::string& help) {
  const auto check = [option](const std::string& name) {
    if (name != "-") check_output_file(name, option);  // which may stand for standard output
    return std::string();
  };
  return add_text(command, option, file, "FILE", help)->check(CLI::Validator(check, ""));
}

std::vector<std::string> list_items(const std::string& list) {
  std::vector<std::string> parts(1);
  for (const char c : list) c == ',' ? void(parts.emplace_back()) : parts.back().push_back(c);
  return parts;
}

void exclude(CLI::App& command, const std::string& option, const std::vector<std::string>& others) {
  for (const std::string& other : others) command.get_option(option)->excludes(command.get_option(other));
}

void add_graph_options(CLI::App& command, CommonOptions& o) {
  command.option_defaults()->group(kWhatRuns);
  add_text(command, "--graph", o.graph, "GRAPH",
           "A name (`hotpath list graphs`), or the path of a YAML file");
  add_scaling_options(command, o);
  add_choice(command, "--work", o.work,
             "How a node works: a fixed amount, for a span of time, or\nof CPU time; by default what the "
             "graph says");
  add_choice(command, "--phases", o.phases,
             "When timers start: one after another as under rclcpp,\n"
             "all at once, as the graph file says, or at random");
  add_text(command, "--phases-file", o.phases_file, "FILE",
           "As `--phases given`, from a CSV file: see docs/phases.md");
  add_number(command, "--phase-step", o.phase_step_ms, {0, 1e6}, "MS",
             "With `--phases creation`: time from one node to the next;\n"
             "by default what rclcpp needs for it");
  add_choice(command, "--rule", o.rule,
             "Subscriptions under the paper's executors: priority of\n"
             "the timers upstream, or before all timers");
  add_text(command, "--entity-order", o.entity_order, "creation|reverse|FILE",
           "Order in which wait sets, and no other executors, scan\n"
           "tasks: with rclcpp that of addresses in memory; FILE has\na task's name in each line");
  add_choice(command, "--ties", o.ties, "At equal priority: latest or earliest activation first");
  exclude(command, "--phases-file", {"--phases", "--phase-step"});
}

void add_scaling_options(CLI::App& command, CommonOptions& o) {
  add_number(command, "--load", o.load_percent, kLoads, "PERCENT",
             "Work of all nodes in percent of one core, 0 for none;\nby default what the graph says");
  add_number(command, "--rate", o.rate_percent, kRates, "PERCENT",
             "After that: how often timers are due, in percent of\nwhat the graph says; jobs stay as long");
  add_number(command, "--copies", o.copies, kCopies, "N",
             "After that: the whole graph so many times side by side");
}

std::vector<std::string> given_options(const CLI::App& command, const std::vector<std::string>& without) {
  std::vector<std::string> words;
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0 || option->get_lnames().empty()) continue;
    const std::string& name = option->get_lnames().front();
    if (std::ranges::count(without, name) > 0) continue;
    words.push_back("--" + name +
                    (option->get_expected_max() == 0 ? "" : "=" + joined(option->results(), ",")));
  }
  return words;
}

void add_length_options(CLI::App& command, CommonOptions& o, double longest_s) {
  command.option_defaults()->group(kHowLong);
  add_number(command, "--duration", o.duration_s, {0.1, longest_s}, "SECONDS",
             "Measured time of each repetition");
  add_number(command, "--warm-up", o.warm_up_s, {0, 3600}, "SECONDS",
             "Time before that, whose latencies do not count");
  add_number(command, "--repetitions", o.repetitions, {1, 10000}, "N", "Repetitions per executor");
  add_number(command, "--seed", o.seed, kAnySeed, "N",
             "Decides whatever is random, and resampling for the intervals");
}

void add_platform_options(CLI::App& command, PlatformOptions& o) {
  command.option_defaults()->group(
      "The simulated machine, by default as the graph's `platform` says, else without costs");
  add_number(command, "--cores", o.cores, {1, kMaxWorkers}, "N", "Processor cores; else 1");
  add_choice(command, "--timer-thread", o.timer_thread,
             "Priority of the timer management thread: above the\n"
             "executor thread or equal; else raised under the\npaper's executors only, as in live runs");
  for (std::size_t i = 0; i < kPlatformCosts.size(); ++i) {
    const PlatformCost& cost = kPlatformCosts[i];
    add_number(command, option_name(cost.key), o.costs_us[i], {0, kLargestCost_us}, "US",
               std::string(cost.meaning));
  }
}

void add_output_option(CLI::App& command, CommonOptions& o) {
  command.option_defaults()->group("Results");
  add_text(command, "--output", o.output, "FOLDER", "New folder for the results; by default runs/DATE-GRAPH");
  // For run.json, which is the same whatever the folder is called and however many threads simulate.
  command.parse_complete_callback([&command, &o] {
    o.command = given_options(command, {"output", "threads"});
    o.command.insert(o.command.begin(), command.get_name());
  });
}

void add_executors_option(CLI::App& command, const std::string& option, CommonOptions& o) {
  command.option_defaults()->group(kWhatRuns);
  add_list(command, option, o.executors, "NAMES",
           "Names of `hotpath list executors` with commas between,\n"
           "also variants as in rm-ro:first or multi:4; or `paper`\n"
           "(the paper's seven, by default) or `all`");
  add_deployments_option(command, o);
}

void add_deployments_option(CLI::App& command, CommonOptions& o) {
  add_list(command, "--deployments,--deployment", o.deployments, "NAMES",
           "Names of `hotpath list deployments`, paths of YAML files,\n"
           "or cie:FILE for a configuration of Autoware's CIE, with\n"
           "commas between (docs/deployments.md)");
}

std::vector<std::string> executors_of(const CommonOptions& options) {
  const std::vector<std::string>& names = options.executors;
  if (names.empty() && !options.deployments.empty()) return {};
  if (names.empty() || names == std::vector<std::string>{"paper"}) return paper_executor_names();
  return names == std::vector<std::string>{"all"} ? all_executor_names() : names;
}

}  // namespace hotpath
