// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <iostream>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/core/registry.hpp"
#include "program/shown_text.hpp"
#include "program/text.hpp"

namespace hotpath::commands {

namespace {

/// Completes the words after a command; the arrays follow, one entry for each command.
constexpr const char* kFunction = R"(
# The command so far ($command), and the option that the current word is the value of ($option).
_hotpath() {
  local current="${COMP_WORDS[COMP_CWORD]}" command="" option="" word i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    word="${COMP_WORDS[i]}"
    if [[ -n "${_hotpath_commands[${command:-hotpath}]-}" && "$word" != -* ]]; then
      command="${command:+$command }$word"
    fi
  done
  option="${COMP_WORDS[COMP_CWORD - 1]}"
  if [[ "$option" == "=" ]]; then option="${COMP_WORDS[COMP_CWORD - 2]}"; fi
  if [[ "$current" == "=" ]]; then option="${COMP_WORDS[COMP_CWORD - 1]}" current=""; fi
  local kind="${_hotpath_values["$command $option"]-}"
  COMPREPLY=()
  if [[ "$kind" == words:* ]]; then
    COMPREPLY=($(compgen -W "${kind#words:}" -- "$current"))
  elif [[ "$kind" == list:* ]]; then
    local before="" last="${current##*,}"
    if [[ "$current" == *,* ]]; then before="${current%,*},"; fi
    COMPREPLY=($(compgen -P "$before" -W "${kind#list:}" -- "$last"))
  elif [[ "$kind" == file ]]; then
    compopt -o filenames 2> /dev/null
    COMPREPLY=($(compgen -f -- "$current"))
  elif [[ -n "$kind" ]]; then
    COMPREPLY=()  # a number or a text
  elif [[ -n "${_hotpath_commands[${command:-hotpath}]-}" && "$current" != -* ]]; then
    COMPREPLY=($(compgen -W "${_hotpath_commands[${command:-hotpath}]}" -- "$current"))
  elif [[ "$current" == -* ]]; then
    COMPREPLY=($(compgen -W "${_hotpath_options[${command:-hotpath}]-}" -- "$current"))
  else
    compopt -o filenames 2> /dev/null
    COMPREPLY=($(compgen -f -- "$current"))
  fi
}
complete -F _hotpath hotpath
)";

/// What completes the value of an option: `words:...`, `list:...`, `file`, or `text` for nothing.
std::string kind_of(const CLI::Option& option) {
  std::string type = option.get_type_name();
  std::erase_if(type, [](char c) { return c == '[' || c == ']'; });
  if (type.find('|') != std::string::npos) {
    const bool names_file = type.find("FILE") != std::string::npos || type.find("RUN") != std::string::npos;
    if (names_file) return "file";
    std::ranges::replace(type, '|', ' ');
    return "words:" + type;
  }
  const bool executors = option.check_lname("executors") || option.check_lname("executor");
  if (executors && type == "NAMES") {
    std::string names = "list:";
    for (const ExecutorEntry& e : hotpath::executors()) names += program::concat(e.name, " ");
    return names;
  }
  const bool path = type == "FILE" || type == "FOLDER" || type == "RUN" || type == "GRAPH" || type == "PATH";
  return path ? "file" : "text";
}

std::string entry(const std::string& array, const std::string& key, const std::string& value) {
  return program::concat(array, "[\"", key, "\"]=\"", value, "\"\n");
}

void describe(const CLI::App& app, const std::string& command, std::ostream& out) {
  std::vector<std::string> subcommands, options;
  for (const CLI::App* sub : app.get_subcommands({})) subcommands.push_back(sub->get_name());
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;  // an earlier name, which --help leaves out
    for (const std::string& name : option->get_lnames()) {
      options.push_back("--" + name);
      if (option->get_expected_max() > 0)
        out << entry("_hotpath_values", program::concat(command, " --", name), kind_of(*option));
    }
  }
  const std::string key = command.empty() ? "hotpath" : command;
  if (!subcommands.empty()) out << entry("_hotpath_commands", key, program::joined(subcommands, " "));
  out << entry("_hotpath_options", key, program::joined(options, " "));
  for (const CLI::App* sub : app.get_subcommands({})) {
    describe(*sub, command.empty() ? sub->get_name() : command + " " + sub->get_name(), out);
  }
}

}  // namespace

void add_completion_command(CLI::App& app) {
  CLI::App& command =
      *app.add_subcommand("completion", "Print completions of all commands and options for a shell");
  command.footer("Example:  source <(hotpath completion bash)");
  auto shell = std::make_shared<std::string>();
  command.add_option("SHELL", *shell, "Shell that reads the completions")
      ->type_name("")
      ->required()
      ->check(CLI::IsMember({"bash"}).description(""));
  command.callback([&app, shell] {
    std::ostream& out = program::data_output();
    out << "# bash completion for hotpath, made from its command line parser by `hotpath completion bash`\n"
           "declare -gA _hotpath_commands _hotpath_options _hotpath_values\n";
    describe(app, "", out);
    out << kFunction;
  });
}

}  // namespace hotpath::commands
