// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "program/text.hpp"
#include "setup/run_setup.hpp"

namespace hotpath {

/// Adds a subcommand that `run` does, once its options, which live as long as the command, are parsed.
template <class Options, class Run>
std::pair<CLI::App&, Options&> add_command(CLI::App& app, const std::string& name,
                                           const std::string& description, const std::string& example,
                                           Run run) {
  CLI::App& command = *app.add_subcommand(name, description);
  auto options = std::make_shared<Options>();
  if (!example.empty()) command.footer("Example:  " + example);
  command.callback([options, run] { run(*options); });
  return {command, *options};
}

/// The type of a value that may be optional.
template <class Value>
struct Plain {
  using Type = Value;
};
template <class Value>
struct Plain<std::optional<Value>> {
  using Type = Value;
};

/// An option that takes one of an enumeration's words, which are shown in the help in place of the type.
template <class Value>
void add_choice(CLI::App& command, const std::string& option, Value& value, const std::string& help) {
  using Enum = typename Plain<Value>::Type;
  const auto set = [&value](const std::string& text) { value = *parse<Enum>(text); };
  CLI::Option* const added = command.add_option_function<std::string>(option, set, help)
                                 ->check(CLI::IsMember(words<Enum>()).description(""))
                                 ->type_name(joined(words<Enum>(), "|"));
  if constexpr (std::is_same_v<Value, Enum>) added->default_str(to_string(value));
}

/// Refuses an empty text, which commands take for an option that is not given.
CLI::Validator not_empty();

/// An option whose value the help calls `kind`. A number or text that it has before is its default.
template <class Value>
CLI::Option* add_text(CLI::App& command, const std::string& option, Value& value, const std::string& kind,
                      const std::string& help) {
  CLI::Option* const added = command.add_option(option, value, help)->type_name(kind);
  constexpr bool texts =
      std::is_same_v<Value, std::string> || std::is_same_v<Value, std::vector<std::string>>;
  if constexpr (texts) added->check(not_empty());
  constexpr bool plain = std::is_arithmetic_v<Value> || std::is_same_v<Value, std::string>;
  return plain ? added->capture_default_str() : added;
}

/// An option that names a file to write, which is checked before anything is computed.
CLI::Option* add_output_file(CLI::App& command, const std::string& option, std::string& file,
                             const std::string& help);

struct Limits {
  double least, most;
};

/// A number within limits; whole if `value`, which may be optional, is.
template <class Value>
CLI::Option* add_number(CLI::App& command, const std::string& option, Value& value, Limits limits,
                        const std::string& unit, const std::string& help) {
  constexpr bool whole = std::is_integral_v<typename Plain<Value>::Type>;
  const char* const kind = whole ? "whole number" : "number";
  const auto check = [limits, kind](const std::string& text) {
    std::conditional_t<whole, std::int64_t, double> number{};
    const char* const end = text.data() + text.size();
    const auto parsed = std::from_chars(text.data(), end, number);
    const auto n = static_cast<double>(number);
    if (parsed.ec == std::errc{} && parsed.ptr == end && n >= limits.least && n <= limits.most)
      return std::string();
    std::ostringstream range;
    range << "`" << text << "` is not a " << kind << " from " << limits.least << " to " << limits.most;
    return range.str();
  };
  return add_text(command, option, value, unit, help)->check(CLI::Validator(check, ""));
}

/// The names of the options' groups in the help.
inline constexpr const char* kWhatRuns = "What runs";
inline constexpr const char* kHowLong = "How long";

/// Adds --load, which it returns, --rate and --copies.
CLI::Option* add_scaling_options(CLI::App& command, CommonOptions& options);

/// The options that were given to a command, as words `--NAME=VALUE`, without those named.
[[nodiscard]] std::vector<std::string> given_options(const CLI::App& command,
                                                     const std::vector<std::string>& without);

/// Adds --graph, --load, --work, the phases, --rule and --ties; `options` must outlive the parse.
void add_graph_options(CLI::App& command, CommonOptions& options);

/// Adds --duration up to `longest_s`, --warm-up, --repetitions and --seed.
void add_length_options(CLI::App& command, CommonOptions& options, double longest_s);

/// Adds --cores, --timer-thread and what the simulated machine costs.
void add_platform_options(CLI::App& command, PlatformOptions& options);

void add_output_option(CLI::App& command, CommonOptions& options);

/// Executors of a command that takes several, and --deployments. `paper`, or nothing at all, is the paper's
/// seven, `all` is all.
void add_executors_option(CLI::App& command, const std::string& option, CommonOptions& options);
/// Adds --deployments alone.
void add_deployments_option(CLI::App& command, CommonOptions& options);
[[nodiscard]] std::vector<std::string> executors_of(const CommonOptions& options);

}  // namespace hotpath
