// SPDX-License-Identifier: Apache-2.0
#include "commands/option_helpers.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"

namespace hotpath::commands {

namespace {

constexpr double kLargestCost_us = 1e9;
constexpr std::size_t kHelpColumns = 68;  // of the 100 that --help may use

/// release_cost_us -> --release-cost-us
std::string option_name(std::string_view key) {
  std::string name = "--" + std::string(key);
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

}  // namespace

void check_outputs(const CLI::App& command) {
  namespace fs = std::filesystem;
  static const std::set<std::string> kOutputs = {"--output",    "--csv",    "--junit",  "--markdown",
                                                 "--page",      "--svg",    "--record", "--perfetto",
                                                 "--responses", "--witness"};
  const auto canonical = [](const std::string& path) {
    std::error_code error;
    const fs::path found = fs::weakly_canonical(fs::absolute(path, error), error);
    return error ? fs::path(path) : found.has_filename() ? found : found.parent_path();
  };
  const auto same = [](const fs::path& a, const fs::path& b) {
    std::error_code error;  // hard links
    return a == b || (fs::exists(a, error) && fs::exists(b, error) && fs::equivalent(a, b, error));
  };
  std::map<std::string, fs::path> outputs, inputs;
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0) continue;
    const std::string name = option->get_name();
    const bool output = kOutputs.contains(name) || (name == "--contract" && command.get_name() == "analyze");
    for (const std::string& value : option->results()) {
      if (output) {
        if (value != "-") outputs[name] = canonical(value);
        continue;
      }
      std::vector<std::string> parts = list_items(value);
      parts.push_back(value);
      for (std::string part : parts) {
        for (const std::string prefix : {"replay:", "listed:"})
          if (part.starts_with(prefix)) part.erase(0, prefix.size());
        std::error_code error;
        if (!part.empty() && fs::exists(part, error)) inputs[part] = canonical(part);
      }
    }
  }
  static const std::set<fs::path> kOfRun = {"run.json", "jobs.csv", "chains.csv", "summary.json"};
  for (const auto& [option, output] : outputs) {
    for (const auto& [input, path] : inputs) {
      std::error_code error;
      const bool run = fs::exists(path / "run.json", error);
      const bool inside = fs::is_directory(path, error) && same(output.parent_path(), path) &&
                          fs::is_regular_file(output, error);
      const std::string file = output.filename();
      if (same(output, path) || (inside && (!run || kOfRun.contains(file) || file.starts_with("input_"))))
        throw program::UsageError(program::concat(
            option, ": ", output.string(), " is an input of the command (", input, "); name another place"));
    }
    for (const auto& [other, path] : outputs) {
      if (other > option && same(output, path))
        throw program::UsageError(program::concat(option, " and ", other, ": ", output.string(),
                                                  " would be written twice; name two places"));
    }
  }
}

CLI::Validator not_empty() {
  const auto check = [](const std::string& text) {
    return std::string(text.empty() ? "the value is empty; give a value, or leave the option out" : "");
  };
  return CLI::Validator(check, "");
}

CLI::Option* add_output_file(CLI::App& command, const std::string& option, std::string& file,
                             const std::string& help) {
  const auto check = [option](const std::string& name) {
    if (name != "-") program::check_output_file(name, option);  // `-`: standard output
    return std::string();
  };
  return add_text(command, option, file, "FILE", help)->check(CLI::Validator(check, ""));
}

std::string with_range(const std::string& help, Limits limits) {
  if (limits.most >= kAnySeed.most) return help;
  const std::string range = program::text("[%.10g to %.10g]", limits.least, limits.most);
  const std::size_t last_line = help.size() - (help.rfind('\n') + 1);  // npos + 1 is 0
  return help + (last_line + 1 + range.size() > kHelpColumns ? "\n" : " ") + range;
}

std::vector<std::string> list_items(const std::string& list) {
  std::vector<std::string> parts(1);
  for (const char c : list) c == ',' ? void(parts.emplace_back()) : parts.back().push_back(c);
  return parts;
}

void exclude(CLI::App& command, const std::string& option, const std::vector<std::string>& others) {
  for (const std::string& other : others) command.get_option(option)->excludes(command.get_option(other));
}

void add_graph_options(CLI::App& command, setup::CommonOptions& o) {
  command.option_defaults()->group(kSystemGroup);
  add_text(command, "--graph", o.graph, "GRAPH", kGraphHelp);
  add_scaling_options(command, o);
  add_choice(command, "--work", o.work,
             "A job works for an amount of its thread's CPU time, until an\n"
             "instant of the clock, or a fixed amount; by default as in the\n"
             "graph, whose own default is cpu_time");
  add_choice(command, "--phases", o.phases,
             "Timer phases: staggered by node creation as in rclcpp, all\n"
             "equal, given in the graph, or random");
  add_text(command, "--phases-file", o.phases_file, "FILE", "Timer phases from a CSV file (docs/phases.md)");
  add_number(command, "--phase-step", o.phase_step_ms, {0, 1e6}, "MS",
             "Time between the creations of two nodes, with\n"
             "`--phases creation`; by default as in rclcpp");
  add_choice(command, "--rule", o.rule,
             "Priority of subscriptions under the paper's executors:\n"
             "highest priority of the upstream timers, or above all\ntimers");
  add_entity_order_option(command, o);
  add_choice(command, "--ties", o.ties, "Jobs of equal priority: latest or earliest activation first");
  exclude(command, "--phases-file", {"--phases", "--phase-step"});
}

void add_entity_order_option(CLI::App& command, setup::CommonOptions& o) {
  add_text(command, "--entity-order", o.entity_order, "creation|reverse|FILE",
           "Order in which wait sets scan tasks; in rclcpp, the order of\n"
           "addresses in memory. FILE has one task name per line");
}

CLI::Option* add_json_option(CLI::App& command) {
  return command
      .add_flag_callback("--json", program::reserve_output_for_json,
                         "Print the data of the tables as JSON; other text goes to\nstandard error")
      ->group("Results");
}

void add_scaling_options(CLI::App& command, setup::CommonOptions& o) {
  add_number(command, "--load", o.load_percent, setup::kLoads, "PERCENT",
             "Load of all nodes in percent of one core; by default as in\nthe graph");
  add_number(command, "--rate", o.rate_percent, setup::kRates, "PERCENT",
             "Timer rates in percent of the graph's, applied after --load;\n"
             "execution times stay the same");
  add_number(command, "--copies", o.copies, setup::kCopies, "N", "Copies of the scaled graph, side by side");
}

std::vector<std::string> given_options(const CLI::App& command, const std::vector<std::string>& without) {
  std::vector<std::string> words;
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0 || option->get_lnames().empty()) continue;
    const std::string& name = option->get_lnames().front();
    if (std::ranges::count(without, name) > 0) continue;
    words.push_back("--" + name +
                    (option->get_expected_max() == 0 ? "" : "=" + program::joined(option->results(), ",")));
  }
  return words;
}

void add_length_options(CLI::App& command, setup::CommonOptions& o, double longest_s) {
  command.option_defaults()->group(kDurationGroup);
  add_number(command, "--duration", o.duration_s, {0.1, longest_s}, "SECONDS",
             "Measured time of each repetition");
  add_warm_up_option(command, o);
  add_number(command, "--repetitions", o.repetitions, {1, 10000}, "N", "Repetitions per executor");
  add_number(command, "--seed", o.seed, kAnySeed, "N", "Seed of all random choices and of the bootstrap");
}

void add_warm_up_option(CLI::App& command, setup::CommonOptions& o) {
  add_number(command, "--warm-up", o.warm_up_s, {0, 3600}, "SECONDS",
             "Time before the measurement; its latencies do not count");
}

void add_platform_options(CLI::App& command, setup::PlatformOptions& o) {
  command.option_defaults()->group(
      "Simulated machine, by default the graph's `platform`, otherwise one core without costs");
  add_cores_option(command, o.cores);
  add_choice(command, "--timer-thread", o.timer_thread,
             "Priority of the timer management thread: above the executor\n"
             "thread, or equal to it; by_executor raises it under the\n"
             "paper's executors only, as live runs do");
  for (std::size_t i = 0; i < kPlatformCosts.size(); ++i) {
    const PlatformCost& cost = kPlatformCosts[i];
    add_number(command, option_name(cost.key), o.costs_us[i], {0, kLargestCost_us}, "US",
               std::string(cost.meaning));
  }
}

void add_cores_option(CLI::App& command, std::optional<unsigned>& cores) {
  add_number(command, "--cores", cores, {1, kMaxWorkers}, "N",
             "CPU cores; by default as in the graph, otherwise 1");
}

CLI::Option* add_threads_option(CLI::App& command, unsigned& threads) {
  return add_number(command, "--threads", threads, {0, 1024}, "N",
                    "Parallel threads, 0 for one per CPU; results do not depend\non it");
}

void add_output_option(CLI::App& command, setup::CommonOptions& o, const std::string& default_folder) {
  command.option_defaults()->group("Results");
  add_text(command, "--output", o.output, "FOLDER",
           "New folder for the results; by default " + default_folder);
  // For run.json, which depends neither on the folder nor on the number of threads.
  command.parse_complete_callback([&command, &o] {
    o.command = given_options(command, {"output", "threads", "json"});
    o.command.insert(o.command.begin(), command.get_name());
  });
}

void add_executors_option(CLI::App& command, const std::string& option, setup::CommonOptions& o) {
  command.option_defaults()->group(kSystemGroup);
  add_list(command, option, o.executors, "NAMES",
           "Executors (`hotpath list executors`), separated by commas,\n"
           "with variants such as rm-ro:first or multi:4; or `paper`\n"
           "(the paper's seven, the default), or `all`");
  add_deployments_option(command, o);
}

void add_deployments_option(CLI::App& command, setup::CommonOptions& o) {
  add_list(command, "--deployments,--deployment", o.deployments, "NAMES",
           "Deployments, separated by commas: names (`hotpath list\n"
           "deployments`), YAML files, or cie:FILE for a configuration of\n"
           "Autoware's CallbackIsolatedExecutor (docs/deployments.md)");
}

std::vector<std::string> executors_of(const setup::CommonOptions& options) {
  const std::vector<std::string>& names = options.executors;
  if (names.empty() && !options.deployments.empty()) return {};
  if (names.empty() || names == std::vector<std::string>{"paper"}) return setup::paper_executor_names();
  return names == std::vector<std::string>{"all"} ? setup::all_executor_names() : names;
}

}  // namespace hotpath::commands
