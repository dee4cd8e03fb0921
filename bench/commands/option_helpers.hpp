// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "program/text.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::commands {

/// Throws UsageError if an output of a parsed command is one of its inputs, a file of a run or trace
/// that it reads, or another output. Links and relative paths are resolved.
void check_outputs(const CLI::App& command);

/// Adds a subcommand. After parsing it calls `run` with its options, which live as long as the
/// command, or with the command and its options.
template <class Options, class Run>
std::pair<CLI::App&, Options&> add_command(CLI::App& app, const std::string& name,
                                           const std::string& description, const std::string& example,
                                           Run run) {
  CLI::App& command = *app.add_subcommand(name, description);
  auto options = std::make_shared<Options>();
  command.footer(example.empty() ? "" : "Example:  " + example);
  command.callback([&command, options, run] {
    check_outputs(command);
    if constexpr (std::is_invocable_v<Run, const CLI::App&, Options&>) {
      run(std::as_const(command), *options);
    } else {
      run(*options);
    }
  });
  return {command, *options};
}

/// `Value`, or the type that the optional `Value` holds.
template <class Value>
struct Plain {
  using Type = Value;
};
template <class Value>
struct Plain<std::optional<Value>> {
  using Type = Value;
};

/// An option that takes a word of an enumeration; the help lists the words.
template <class Value>
CLI::Option* add_choice(CLI::App& command, const std::string& option, Value& value, const std::string& help) {
  using Enum = typename Plain<Value>::Type;
  const auto set = [&value](const std::string& text) { value = *parse<Enum>(text); };
  CLI::Option* const added = command.add_option_function<std::string>(option, set, help)
                                 ->check(CLI::IsMember(words<Enum>()).description(""))
                                 ->type_name(program::joined(words<Enum>(), "|"));
  if constexpr (std::is_same_v<Value, Enum>) added->default_str(to_string(value));
  return added;
}

/// Rejects an empty text, which commands treat like a missing option.
CLI::Validator not_empty();

/// An option with a value that is not a number. `kind` names the value in the help. The initial
/// text of `value` is its default.
template <class Value>
CLI::Option* add_text(CLI::App& command, const std::string& option, Value& value, const std::string& kind,
                      const std::string& help) {
  static_assert(!std::is_arithmetic_v<typename Plain<Value>::Type>, "add_number() checks numbers");
  CLI::Option* const added = command.add_option(option, value, help)->type_name(kind);
  constexpr bool texts =
      std::is_same_v<Value, std::string> || std::is_same_v<Value, std::vector<std::string>>;
  if constexpr (texts) added->check(not_empty());
  return std::is_same_v<Value, std::string> ? added->capture_default_str() : added;
}

/// An option that names an output file. The file is checked before the command computes anything.
CLI::Option* add_output_file(CLI::App& command, const std::string& option, std::string& file,
                             const std::string& help);

using setup::Limits;
inline constexpr Limits kAnySeed{0, 0x1p64};  // parsing rejects what does not fit std::uint64_t

/// `help` with the range of valid values, except for seeds.
[[nodiscard]] std::string with_range(const std::string& help, Limits limits);

/// Why `text` is not a number within limits; empty for a valid number. Rewrites a whole number,
/// because CLI11 would read 010 as 8.
template <class Number>
std::string refused_number(std::string& text, Limits limits) {
  constexpr bool whole = std::is_integral_v<Number>;
  const std::optional<Number> number = parse<Number>(text);
  const double n = number ? static_cast<double>(*number) : std::nan("");
  if (n >= limits.least && n <= limits.most) {
    if (whole) text = program::concat(*number);
    return "";
  }
  const auto most = static_cast<double>(std::numeric_limits<Number>::max());
  return program::concat("`", text, "` is not a ", whole ? "whole number" : "number", " from ", limits.least,
                         " to ",
                         limits.most < most ? program::concat(limits.most)
                                            : program::concat(std::numeric_limits<Number>::max()));
}

/// A number within limits; a whole number for an integer `value`, which may be optional.
template <class Value>
CLI::Option* add_number(CLI::App& command, const std::string& option, Value& value, Limits limits,
                        const std::string& unit, const std::string& help) {
  const auto check = [limits](std::string& text) {
    return refused_number<typename Plain<Value>::Type>(text, limits);
  };
  CLI::Option* const added = command.add_option(option, value, with_range(help, limits))->type_name(unit);
  if (std::is_arithmetic_v<Value>) added->capture_default_str();
  return added->transform(CLI::Validator(check, ""));
}

/// A comma-separated list of texts without empty items. The option may be given several times. `each`
/// validates an item.
CLI::Option* add_list(CLI::App& command, const std::string& option, std::vector<std::string>& items,
                      const std::string& kind, const std::string& help,
                      const CLI::Validator& each = CLI::Validator(""));

/// Rejects `option` together with any of `others`, which it would contradict or which would be
/// ignored.
void exclude(CLI::App& command, const std::string& option, const std::vector<std::string>& others);

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

/// Adds --json to a command that prints tables: it calls program::show_json() once.
CLI::Option* add_json_option(CLI::App& command);

/// Adds --load, --rate and --copies.
void add_scaling_options(CLI::App& command, setup::CommonOptions& options);

/// The options given to a command, as words `--NAME=VALUE`, except the options in `without`.
[[nodiscard]] std::vector<std::string> given_options(const CLI::App& command,
                                                     const std::vector<std::string>& without);

/// Adds the graph, its scaling, --work, --phases and --entity-order; `options` must outlive the parse.
void add_graph_options(CLI::App& command, setup::CommonOptions& options);
/// Adds the graph, as a position or as --graph.
CLI::Option* add_graph_option(CLI::App& command, std::string& graph);
/// Adds --phases: a word, the step of `creation`, a file or a run. `given`, if any, becomes true with it.
CLI::Option* add_phases_option(CLI::App& command, setup::CommonOptions& options, const std::string& help,
                               bool* given = nullptr);
/// Why --phases refuses a text; empty for a valid one.
[[nodiscard]] std::string refused_phases(const std::string& text);
void set_phases(setup::CommonOptions& options, const std::string& text);
void add_entity_order_option(CLI::App& command, setup::CommonOptions& options);

/// Adds --duration up to `longest_s`, --warm-up, --repetitions and --seed.
void add_length_options(CLI::App& command, setup::CommonOptions& options, double longest_s);
void add_warm_up_option(CLI::App& command, setup::CommonOptions& options);

/// Adds --cores and --platform, which describe the simulated machine.
void add_platform_options(CLI::App& command, setup::PlatformOptions& options);
void add_cores_option(CLI::App& command, std::optional<unsigned>& cores);
CLI::Option* add_threads_option(CLI::App& command, unsigned& threads);

/// Adds --output. `default_folder`: as the help shows it.
void add_output_option(CLI::App& command, setup::CommonOptions& options,
                       const std::string& default_folder = "runs/DATE-GRAPH");

/// Adds --executors and --deployments. executors_of() resolves `paper` and `all`.
void add_executors_option(CLI::App& command, setup::CommonOptions& options);
void add_deployments_option(CLI::App& command, setup::CommonOptions& options);
/// The executors to run: the paper's seven for `paper` or without any executor or deployment, the
/// whole registry for `all`.
[[nodiscard]] std::vector<std::string> executors_of(const setup::CommonOptions& options);

}  // namespace hotpath::commands
