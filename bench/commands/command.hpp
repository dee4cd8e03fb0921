// SPDX-License-Identifier: Apache-2.0
#pragma once

// What commands share, with the headers of program/ that most of them use.

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "live/live_run.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/table.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "setup/run_setup.hpp"
#include "simulated/simulated_run.hpp"

namespace hotpath::guarantees {
struct AnalyzeOptions;
}

namespace hotpath::commands {

using program::concat, program::fixed, program::joined, program::text;
using program::RunError, program::Table, program::UsageError;

/// A command. Each is one file, which has one of these. `adds` adds the subcommand, whose callback throws
/// UsageError or RunError. `group` and `place`: in the help; an empty group hides it.
struct Command {
  Command(const std::string& group, int place, void (*adds)(CLI::App& app));
};

/// Adds all commands in the order of their places.
void add_commands(CLI::App& app);
/// Writes the pages of --help and --help-all.
[[nodiscard]] std::shared_ptr<CLI::FormatterBase> help_formatter();
/// In bytes; a message may quote a name of any length.
inline constexpr std::size_t kLongestMessage = 4000;
/// The message on a command line that `app` refused, for an unknown word with the most similar one.
[[nodiscard]] std::string wrong_use(const CLI::App* app, const CLI::Error& error);

/// Adds a subcommand. After parsing it calls `run` if no output of the command is one of its inputs, a file
/// of a run or trace that it reads, or another output, whatever links they are behind.
CLI::App& add_command(CLI::App& app, const std::string& name, const std::string& description,
                      const std::string& example, const std::function<void(const CLI::App&)>& run);
/// The same with options, which live as long as the command. `run` gets them, or the command and them.
template <class Options>
std::pair<CLI::App&, Options&> add_command(CLI::App& app, const std::string& name,
                                           const std::string& description, const std::string& example,
                                           auto run) {
  const auto options = std::make_shared<Options>();
  return {add_command(app, name, description, example,
                      [options, run](const CLI::App& command) {
                        if constexpr (std::is_invocable_v<decltype(run), const CLI::App&, Options&>) {
                          run(command, *options);
                        } else {
                          run(*options);
                        }
                      }),
          *options};
}
/// Adds a subcommand that only has subcommands.
CLI::App& add_parent(CLI::App& app, const std::string& name, const std::string& description,
                     const std::string& example);

/// The options that --help of a command shows; --help-all shows the others, too.
void show_first(const CLI::App& command, const std::vector<std::string>& options);

/// Of the type of a value, or of what an optional value holds.
template <class T>
T plain(const T& value);
template <class T>
T plain(const std::optional<T>& value);

/// `help`, in several lines if it is longer than one and has no line breaks of its own.
[[nodiscard]] std::string in_lines(const std::string& help);

/// An option whose text `parse` turns into its value, or refuses by CLI::ValidationError or UsageError.
template <class Value>
CLI::Option* add_parsed(CLI::App& command, const std::string& option, Value& value, const auto& parse,
                        const std::string& kind, const std::string& help) {
  const auto set = [&value, parse](const std::string& text) { value = parse(text); };
  return command.add_option_function<std::string>(option, set, in_lines(help))->type_name(kind);
}

/// `; did you mean ...?` with the candidate most similar to the word; empty if none is similar.
[[nodiscard]] std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates);

/// The value of a word. Throws CLI::ValidationError for the option.
template <class Enum>
Enum value_of(const std::string& option, const std::string& word) {
  if (const auto value = parse<Enum>(word)) return *value;
  throw CLI::ValidationError(
      option, word + " not in {" + joined(words<Enum>(), ",") + "}" + did_you_mean(word, words<Enum>()));
}

/// Adds an option, or a position if its name has no dashes, that sets `value`: a flag, or a word of an
/// enumeration, whose words the help lists.
template <class Value>
CLI::Option* add(CLI::App& command, const std::string& option, Value& value, const std::string& help) {
  using Enum = decltype(plain(value));
  if constexpr (std::is_same_v<Enum, bool>) {
    return command.add_flag(option, value, in_lines(help));
  } else {
    const auto read = [option](const std::string& word) { return value_of<Enum>(option, word); };
    CLI::Option* const added = add_parsed(command, option, value, read, joined(words<Enum>(), "|"), help);
    if constexpr (std::is_same_v<Value, Enum>) added->default_str(to_string(value));
    return added;
  }
}

/// Rejects an empty text, which commands treat like a missing option.
CLI::Validator not_empty();

/// One with a text, or several texts. `kind` names the value in the help. The initial text of `value` is its
/// default.
template <class Value>
CLI::Option* add(CLI::App& command, const std::string& option, Value& value, const std::string& kind,
                 const std::string& help) {
  CLI::Option* const added = command.add_option(option, value, in_lines(help))->type_name(kind);
  if constexpr (!std::is_same_v<Value, std::optional<std::string>>) added->check(not_empty());
  return std::is_same_v<Value, std::string> ? added->capture_default_str() : added;
}

/// An option that names an output file. The file is checked before the command computes anything.
CLI::Option* add_output_file(CLI::App& command, const std::string& option, std::string& file,
                             const std::string& help);

using setup::Limits;
inline constexpr Limits kAnySeed{0, 0x1p64};  // parsing rejects what does not fit std::uint64_t

/// `help` with the range of valid values, except for seeds.
[[nodiscard]] std::string with_range(const std::string& help, Limits limits);

/// The decimal number within limits. Throws CLI::ValidationError for the option.
template <class Number>
Number value_of(const std::string& option, const std::string& text, Limits limits) {
  const std::optional<Number> number = parse<Number>(text);
  const double n = number ? static_cast<double>(*number) : std::nan("");
  if (n >= limits.least && n <= limits.most) return *number;
  constexpr Number kMost = std::numeric_limits<Number>::max();
  const bool below = limits.most < static_cast<double>(kMost);
  throw CLI::ValidationError(
      option, concat("`", text, "` is not a ", std::is_integral_v<Number> ? "whole " : "", "number from ",
                     limits.least, " to ", below ? concat(limits.most) : concat(kMost)));
}

/// One with a number within limits, a whole number for an integer `value`, which may be optional.
template <class Value>
CLI::Option* add(CLI::App& command, const std::string& option, Value& value, Limits limits,
                 const std::string& unit, const std::string& help) {
  using Number = decltype(plain(value));
  const auto read = [option, limits](const std::string& word) {
    return value_of<Number>(option, word, limits);
  };
  CLI::Option* const added = add_parsed(command, option, value, read, unit, with_range(help, limits));
  if constexpr (std::is_same_v<Value, Number>) added->default_str(concat(value));
  return added;
}

/// A comma-separated list without empty items. The option may be given several times. `set` gets all
/// items, and refuses one as `parse` of add_parsed().
CLI::Option* add_list(CLI::App& command, const std::string& option,
                      const std::function<void(const std::vector<std::string>&)>& set,
                      const std::string& kind, const std::string& help);
/// The same for a list of texts.
CLI::Option* add_list(CLI::App& command, const std::string& option, std::vector<std::string>& items,
                      const std::string& kind, const std::string& help);

/// Option groups in the help.
inline constexpr const char* kSystemGroup = "Graph and executors";
inline constexpr const char* kDurationGroup = "Duration and repetitions";

/// Help of options that several commands have.
inline constexpr const char* kGraphHelp = "Graph name (`hotpath list graphs`) or path of a YAML file";
inline constexpr const char* kRunHelp = "Folder of a live or simulated run";
inline constexpr const char* kRunExecutorHelp = "Executor of the run; by default its first";
inline constexpr const char* kRunRepetitionHelp = "Repetition of the run, counted from 0";
inline constexpr const char* kDomainHelp = "DDS domain id";
inline constexpr const char* kAllInterfacesHelp = "Use all network interfaces, not only loopback";
inline constexpr const char* kJunitHelp = "Also write the gate's tests for CI (JUnit XML)";
inline constexpr const char* kMarkdownHelp = "Also write the gate's summary for a pull request";

// Options of several commands; what they set must outlive the parse.

/// --json of a command that prints tables: it calls program::show_json() once.
CLI::Option* add_json_option(CLI::App& command);
CLI::Option* add_set_option(CLI::App& command, std::vector<std::string>& set);
/// --set, --load, --rate and --copies.
void add_scaling_options(CLI::App& command, setup::CommonOptions& options);
/// The graph, its scaling, --work, --phases and --entity-order.
void add_graph_options(CLI::App& command, setup::CommonOptions& options);
/// --phases: a word, the step of `creation`, a file or a run. `given`, if any, becomes true with it.
CLI::Option* add_phases_option(CLI::App& command, setup::CommonOptions& options, const std::string& help,
                               bool* given = nullptr);
/// Sets what --phases names. Throws CLI::ValidationError.
void set_phases(setup::CommonOptions& options, const std::string& text);
/// The words that it takes, as the kind of its value.
[[nodiscard]] std::string phase_words();
void add_entity_order_option(CLI::App& command, setup::CommonOptions& options);
/// --duration up to `longest_s`, --warm-up, --repetitions and --seed.
void add_length_options(CLI::App& command, setup::CommonOptions& options, double longest_s);
void add_warm_up_option(CLI::App& command, setup::CommonOptions& options);
/// --cores and --platform, which describe the simulated machine.
void add_platform_options(CLI::App& command, setup::PlatformOptions& options);
void add_cores_option(CLI::App& command, std::optional<unsigned>& cores);
CLI::Option* add_threads_option(CLI::App& command, unsigned& threads);
/// --output. `default_folder`: as the help shows it.
void add_output_option(CLI::App& command, setup::CommonOptions& options,
                       const std::string& default_folder = "runs/DATE-GRAPH");
/// --executors and --deployments.
void add_executors_option(CLI::App& command, setup::CommonOptions& options);
void add_deployments_option(CLI::App& command, setup::CommonOptions& options);
/// The executors to run: the paper's seven for `paper` or without any executor or deployment, the
/// whole registry for `all`.
[[nodiscard]] std::vector<std::string> executors_of(const setup::CommonOptions& options);

/// The options given to a command, as words `--NAME=VALUE`, except the options in `without`.
[[nodiscard]] std::vector<std::string> given_options(const CLI::App& command,
                                                     const std::vector<std::string>& without);
/// Writes an example into a new YAML file (--new), and names the command to use it with. Throws UsageError.
void write_example(const std::string& file, const std::string& example, const char* next);

/// The command line of `run`.
struct RunOptions : live::Options {
  std::string against, junit, markdown;
};
void add_run_options(CLI::App& command, RunOptions& options);
void add_simulate_options(CLI::App& command, simulated::Options& options);
/// Those without --no-trace, --output and --json.
void add_simulation_options(CLI::App& command, simulated::Options& options);
/// Those without --contract and --margin.
void add_analyze_options(CLI::App& command, guarantees::AnalyzeOptions& options);
/// Adds `paper threads`.
void add_paper_threads(CLI::App& paper);

}  // namespace hotpath::commands
