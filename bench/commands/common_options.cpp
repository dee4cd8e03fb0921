// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>

#include "commands/command.hpp"
#include "hotpath/core/suggestion.hpp"
#include "hotpath/reference_system/yaml_file.hpp"

namespace hotpath::commands {

namespace {

constexpr double kLargestCost_us = 1e9;
constexpr double kLongestStep_ms = 1e6;
constexpr std::size_t kHelpColumns = 68;  // of the 100 that --help may use
constexpr std::size_t kBrokenColumns = 61;

/// Sets one `KEY=VALUE` of --platform.
void set_platform(setup::PlatformOptions& o, const std::string& item) {
  const std::size_t end = std::min(item.find('='), item.size());
  const std::string key = item.substr(0, end), value = item.substr(std::min(end + 1, item.size()));
  std::string keys = "timer_thread";
  if (key == keys) {
    o.timer_thread = parse<TimerThread>(value);
    if (o.timer_thread) return;
    throw CLI::ValidationError("--platform", "timer_thread is one of " + joined(words<TimerThread>()));
  }
  for (std::size_t i = 0; i < kPlatformCosts.size(); ++i) {
    keys += concat(", ", kPlatformCosts[i].key);
    if (key != kPlatformCosts[i].key) continue;
    o.costs_us[i] = value_of<double>("--platform: " + key, value, {0, kLargestCost_us});
    return;
  }
  throw CLI::ValidationError("--platform",
                             concat("`", item, "` is no KEY=VALUE of a platform; its keys are ", keys));
}

/// The items of a comma-separated list.
std::vector<std::string> list_items(const std::string& list) {
  std::vector<std::string> parts(1);
  for (const char c : list) c == ',' ? void(parts.emplace_back()) : parts.back().push_back(c);
  return parts;
}

/// Groups and adding functions, by place; filled before main() begins.
std::map<int, std::pair<std::string, void (*)(CLI::App&)>>& all_commands() {
  static std::map<int, std::pair<std::string, void (*)(CLI::App&)>> all;
  return all;
}

namespace fs = std::filesystem;

/// Links and relative paths are resolved.
fs::path canonical(const std::string& path) {
  std::error_code error;
  const fs::path found = fs::weakly_canonical(fs::absolute(path, error), error);
  return error ? fs::path(path) : found.has_filename() ? found : found.parent_path();
}

/// Also by hard links.
bool same(const fs::path& a, const fs::path& b) {
  std::error_code error;
  return a == b || (fs::exists(a, error) && fs::exists(b, error) && fs::equivalent(a, b, error));
}

/// Whether an output would change what a command reads at `input`.
bool changes(const fs::path& output, const fs::path& input) {
  static const std::set<std::string> kOfRun = {"run.json", "jobs.csv", "chains.csv", "summary.json"};
  std::error_code error;
  if (same(output, input)) return true;
  if (!fs::is_directory(input, error) || !same(output.parent_path(), input) ||
      !fs::is_regular_file(output, error))
    return false;
  const std::string file = output.filename();
  return !fs::exists(input / "run.json", error) || kOfRun.contains(file) || file.starts_with("input_");
}

std::set<const CLI::Option*> output_files;  // of add_output_file()

/// Throws UsageError if an output of a parsed command is one of its inputs or another output.
void check_outputs(const CLI::App& command) {
  std::error_code error;
  std::map<std::string, fs::path> outputs, inputs;
  for (const CLI::Option* option : command.get_options()) {
    // A folder that an option names is written; those that arguments name are read.
    const bool folder = option->nonpositional() && option->get_type_name() == "FOLDER";
    const bool output = folder || output_files.contains(option);
    for (const std::string& value : option->results()) {
      if (output && value != "-") outputs[option->get_name()] = canonical(value);
      std::vector<std::string> parts = list_items(value);
      parts.push_back(value);
      for (const std::string& part : parts)
        for (const std::string& path : {part, part.substr(part.find(':') + 1)})  // such as replay:RUN
          if (!output && !path.empty() && fs::exists(path, error)) inputs[path] = canonical(path);
    }
  }
  for (const auto& [option, output] : outputs) {
    for (const auto& [input, path] : inputs)
      if (changes(output, path))
        throw UsageError(concat(option, ": ", output.string(), " is an input of the command (", input,
                                "); name another place"));
    for (const auto& [other, path] : outputs)
      if (other > option && same(output, path))
        throw UsageError(concat(option, " and ", other, ": ", output.string(),
                                " would be written twice; name two places"));
  }
}

}  // namespace

Command::Command(const std::string& group, int place, void (*adds)(CLI::App& app)) {
  all_commands()[place] = {group, adds};
}

void add_commands(CLI::App& app) {
  for (const auto& [place, command] : all_commands()) {
    command.second(app);
    app.get_subcommands({}).back()->group(command.first);
  }
}

CLI::App& add_command(CLI::App& app, const std::string& name, const std::string& description,
                      const std::string& example, const std::function<void(const CLI::App&)>& run) {
  CLI::App& command = *app.add_subcommand(name, description);
  command.footer(example.empty() ? "" : "Example:  " + example);
  command.callback([&command, run] {
    check_outputs(command);
    const CLI::Option* const set = command.get_option_no_throw("--set");
    if (set != nullptr && set->count() > 0)
      std::cerr << "note: with " << joined(set->results(), ", ") << " in the graph\n";
    run(command);
  });
  return command;
}

CLI::App& add_parent(CLI::App& app, const std::string& name, const std::string& description,
                     const std::string& example) {
  return *app.add_subcommand(name, description)->footer("Example:  " + example)->require_subcommand(1);
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates) {
  const std::optional<std::string> best = nearest(word, candidates);
  return best ? concat("; did you mean `", *best, "`?") : "";
}

CLI::Validator not_empty() {
  constexpr const char* kProblem = "the value is empty; give a value, or leave the option out";
  return {[](const std::string& text) { return std::string(text.empty() ? kProblem : ""); }, ""};
}

CLI::Option* add_output_file(CLI::App& command, const std::string& option, std::string& file,
                             const std::string& help) {
  CLI::Option* const added = add(command, option, file, "FILE", help);
  output_files.insert(added);
  return added->check([option](const std::string& name) {
    if (name != "-") program::check_output_file(name, option);  // `-`: standard output
    return std::string();
  });
}

std::string in_lines(const std::string& help) {
  if (help.size() <= kHelpColumns || help.find('\n') != std::string::npos) return help;
  std::string lines = program::wrapped(help, kBrokenColumns);
  lines.pop_back();
  return lines;
}

std::string with_range(const std::string& text, Limits limits) {
  std::string help = in_lines(text);
  if (limits.most >= kAnySeed.most) return help;
  const std::string range = program::text("[%.10g to %.10g]", limits.least, limits.most);
  const std::size_t last_line = help.size() - (help.rfind('\n') + 1);  // npos + 1 is 0
  return help + (last_line + 1 + range.size() > kHelpColumns ? "\n" : " ") + range;
}

CLI::Option* add_list(CLI::App& command, const std::string& option,
                      const std::function<void(const std::vector<std::string>&)>& set,
                      const std::string& kind, const std::string& help) {
  const auto read = [option, set](const std::vector<std::string>& lists) {
    std::vector<std::string> items;
    for (const std::string& list : lists) {
      for (const std::string& item : list_items(list)) {
        if (item.empty())
          throw CLI::ValidationError(option, "`" + list + "` has an empty item; separate items by one comma");
        items.push_back(item);
      }
    }
    set(items);
  };
  return command.add_option_function<std::vector<std::string>>(option, read, in_lines(help))
      ->allow_extra_args(false)  // a further argument is not a further item
      ->check(not_empty())
      ->type_name(kind);
}

CLI::Option* add_list(CLI::App& command, const std::string& option, std::vector<std::string>& items,
                      const std::string& kind, const std::string& help) {
  const auto set = [&items](const std::vector<std::string>& texts) { items = texts; };
  return add_list(command, option, set, kind, help)->default_str(joined(items, ","));
}

void add_graph_options(CLI::App& command, setup::CommonOptions& o) {
  command.option_defaults()->group(kSystemGroup);
  add(command, "GRAPH,--graph", o.graph, "NAME", kGraphHelp);
  add_scaling_options(command, o);
  add(command, "--work", o.work,
      "A job works for an amount of its thread's CPU time, until an instant of the clock, or a fixed amount; "
      "by default as in the graph, whose own default is cpu_time");
  add_phases_option(
      command, o,
      "Timer phases: staggered by node creation as in rclcpp, or by MS; all equal; given in the graph; "
      "random; of a CSV file (docs/phases.md); or of the same executor in a stored run")
      ->default_str(to_string(o.phases));
  add_entity_order_option(command, o);
}

void set_phases(setup::CommonOptions& o, const std::string& text) {
  static const std::string kBeforeStep = concat(to_string(Phases::creation), ":");
  std::error_code error;
  o.phases_file = o.phases_of = "";
  o.phase_step_ms.reset();
  if (const auto named = parse<Phases>(text)) {
    o.phases = *named;
  } else if (text.starts_with(kBeforeStep)) {
    o.phases = Phases::creation;
    o.phase_step_ms = value_of<double>("--phases", text.substr(kBeforeStep.size()), {0, kLongestStep_ms});
  } else if (std::filesystem::exists(text, error)) {
    o.phases = Phases::given;
    (std::filesystem::is_directory(text) ? o.phases_of : o.phases_file) = text;
  } else {
    throw CLI::ValidationError("--phases",
                               concat("`", text, "` is none of ", joined(words<Phases>()), ", ", kBeforeStep,
                                      "MS, and no file or folder", did_you_mean(text, words<Phases>())));
  }
}

std::string phase_words() {
  std::vector<std::string> all = words<Phases>();
  *std::ranges::find(all, to_string(Phases::creation)) += "[:MS]";
  return joined(all, "|");
}

CLI::Option* add_phases_option(CLI::App& command, setup::CommonOptions& o, const std::string& help,
                               bool* given) {
  const auto set = [&o, given](const std::string& text) {
    set_phases(o, text);
    if (given != nullptr) *given = true;
  };
  return command.add_option_function<std::string>("--phases", set, in_lines(help))
      ->type_name(phase_words() + "|FILE|RUN");
}

void add_entity_order_option(CLI::App& command, setup::CommonOptions& o) {
  add_parsed(command, "--entity-order", o.entity_order, setup::EntityOrder::parse, "creation|reverse|FILE",
             "Order in which wait sets scan tasks; in rclcpp, the order of addresses in memory. FILE has one "
             "task name per line")
      ->check(not_empty())
      ->default_str(o.entity_order.text());
}

CLI::Option* add_json_option(CLI::App& command) {
  return command
      .add_flag_callback("--json", program::reserve_output_for_json,
                         in_lines("Print the data of the tables as JSON; other text goes to standard error"))
      ->group("Results");
}

CLI::Option* add_set_option(CLI::App& command, std::vector<std::string>& set) {
  return add_list(
      command, "--set", set, "NODE.KEY=VALUE",
      "Another value for a key of a node of the graph, in the units of its file, such as Lidar.period_ms=50; "
      "of a node of type callbacks for a task: Localizer/points.execution_time_ms=3");
}

void add_scaling_options(CLI::App& command, setup::CommonOptions& o) {
  add_set_option(command, o.set);
  add(command, "--load", o.load_given, setup::kLoads, "PERCENT",
      "Load of all nodes in percent of one core; by default as in\nthe graph");
  add(command, "--rate", o.rate_percent, setup::kRates, "PERCENT",
      "Timer rates in percent of the graph's, applied after --load; execution times stay the same");
  add(command, "--copies", o.copies, setup::kCopies, "N", "Copies of the scaled graph, side by side");
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

void write_example(const std::string& file, const std::string& example, const char* next) {
  program::check_output_file(file, "--new");
  if (!is_yaml_path(file)) throw UsageError("--new " + file + ": give the file the extension .yaml");
  if (std::filesystem::exists(file)) throw UsageError("--new " + file + ": the file exists; name a new one");
  program::write_output_file(file, "--new", example);
  std::cout << "Wrote " << file << "; next: hotpath " << next << " " << file << "\n";
}

void add_length_options(CLI::App& command, setup::CommonOptions& o, double longest_s) {
  command.option_defaults()->group(kDurationGroup);
  add(command, "--duration", o.duration_s, {0.1, longest_s}, "SECONDS", "Measured time of each repetition");
  add_warm_up_option(command, o);
  add(command, "--repetitions", o.repetitions, {1, 10000}, "N", "Repetitions per executor");
  add(command, "--seed", o.seed, kAnySeed, "N", "Seed of all random choices and of the bootstrap");
}

void add_warm_up_option(CLI::App& command, setup::CommonOptions& o) {
  add(command, "--warm-up", o.warm_up_s, {0, 3600}, "SECONDS",
      "Time before the measurement; its latencies do not count");
}

void add_platform_options(CLI::App& command, setup::PlatformOptions& o) {
  command.option_defaults()->group(
      "Simulated machine, by default the graph's `platform`, otherwise one core without costs");
  add_cores_option(command, o.cores);
  std::string help = in_lines(
      "Costs in microseconds and the timer thread, separated by commas, such as "
      "release_cost_us=3,timer_thread=raised");
  for (const PlatformCost& cost : kPlatformCosts) {
    const bool fits = cost.key.size() + cost.meaning.size() + 2 <= kHelpColumns;
    help += concat("\n", cost.key, fits ? ": " : ":\n  ", cost.meaning);
  }
  help += "\ntimer_thread: " + joined(words<TimerThread>()) +
          "; by_executor raises it\nunder the paper's executors only, as live runs do";
  const auto set = [&o](const std::vector<std::string>& items) {
    for (const std::string& item : items) set_platform(o, item);
  };
  add_list(command, "--platform", set, "KEY=VALUE", help);
}

void add_cores_option(CLI::App& command, std::optional<unsigned>& cores) {
  add(command, "--cores", cores, {1, kMaxWorkers}, "N", "CPU cores; by default as in the graph, otherwise 1");
}

CLI::Option* add_threads_option(CLI::App& command, unsigned& threads) {
  return add(command, "--threads", threads, {0, 1024}, "N",
             "Parallel threads, 0 for one per CPU; results do not depend\non it");
}

void add_output_option(CLI::App& command, setup::CommonOptions& o, const std::string& default_folder) {
  command.option_defaults()->group("Results");
  add(command, "--output", o.output, "FOLDER", "New folder for the results; by default " + default_folder);
  // For run.json, which depends neither on the folder nor on the number of threads.
  command.parse_complete_callback([&command, &o] {
    o.command = given_options(command, {"output", "threads", "json"});
    o.command.insert(o.command.begin(), command.get_name());
  });
}

void add_executors_option(CLI::App& command, setup::CommonOptions& o) {
  command.option_defaults()->group(kSystemGroup);
  add_list(command, "--executors", o.executors, "NAMES",
           "Executors (`hotpath list executors`), separated by commas,\n"
           "with variants such as rm-ro:first or multi:4; or `paper`\n"
           "(the paper's seven, the default), or `all`");
  add_deployments_option(command, o);
}

void add_deployments_option(CLI::App& command, setup::CommonOptions& o) {
  add_list(command, "--deployments", o.deployments, "NAMES",
           "Deployments, separated by commas: names (`hotpath list deployments`), YAML files, or cie:FILE "
           "for a configuration of Autoware's CallbackIsolatedExecutor (docs/deployments.md)");
}

std::vector<std::string> executors_of(const setup::CommonOptions& options) {
  const std::vector<std::string>& names = options.executors;
  if (names.empty() && !options.deployments.empty()) return {};
  if (names.empty() || names == std::vector<std::string>{"paper"}) return setup::paper_executor_names();
  return names == std::vector<std::string>{"all"} ? setup::all_executor_names() : names;
}

}  // namespace hotpath::commands
